# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ranges that are otherwise than the payload says, found from the flight itself.

The recording is ideal, and its payload calls all ranges 25 mm too long: what there is to find is as large
and as constant as on a real rangefinder, and its truth is exactly zero.
"""

from __future__ import annotations

import json

import pytest

from bentwing.evaluate.simulated import score
from bentwing.recording import Payload
from bentwing.run.pipeline import map_recording

pytestmark = pytest.mark.slow

CLAIMED = 0.025  # m
FROZEN = ("range_offset", "range_grazing")


@pytest.fixture(scope="module")
def misjudged(simulated, tmp_path_factory):
    """Scores and calibrations of a flight whose payload is wrong: free to be corrected, and not."""
    folder, out = simulated("courtyard", 30.0), tmp_path_factory.mktemp("ranges")
    payload = Payload.load(folder / "payload.yaml")
    lidar = {**payload.lidar.differing(), "ranges": {"offset": CLAIMED}}
    wrong = payload.model_copy(update={"lidar": type(payload.lidar).model_validate(lidar)})

    def fly(name, frozen):
        settings = out / f"{name}.yaml"
        settings.write_text(json.dumps({"loop_closure": {"frozen": frozen}}))
        map_recording(folder / "recording.bag", wrong, out / name, settings=settings, threads=2)
        calibration = json.loads((out / name / "run.json").read_text())["calibration"]
        return score(folder, out / name), calibration

    return {name: fly(name, frozen) for name, frozen in (("free", ()), ("frozen", FROZEN))}


def test_ranges_that_are_too_short_are_found_to_millimetres(misjudged):
    _, calibration = misjudged["free"]
    (std,) = calibration["std"]["range_offset"]
    # A tenth is what the curvature of surfaces and their patches may feign.
    assert abs(calibration["ranges"]["offset"]) < 0.1 * CLAIMED
    assert std < 0.1 * CLAIMED


def test_a_flight_is_as_accurate_as_with_ranges_that_are_known(misjudged):
    """3 mm and 1.3 times the best map, as flights of an ideal sensor; without it several times as much."""
    found, _ = misjudged["free"]
    left, calibration = misjudged["frozen"]
    assert calibration["ranges"]["offset"] == CLAIMED
    assert found.ate_flight < 0.003
    assert found.map_ratio < 1.3
    assert left.ate_flight > 1.5 * found.ate_flight
    assert left.map_ratio > 1.2 * found.map_ratio
