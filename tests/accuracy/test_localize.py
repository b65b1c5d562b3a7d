# SPDX-License-Identifier: MIT OR Apache-2.0
"""A second flight in the map of a first one, with another start, another calibration and other noise."""

from __future__ import annotations

import json

import pytest

from bentwing.base.errors import EstimationError
from bentwing.evaluate.simulated import localized_score
from bentwing.map.read import read_points
from bentwing.run.pipeline import map_recording

PAYLOAD, RECORDING = "payload.yaml", "recording.bag"


@pytest.fixture(scope="module")
def flights(flown, simulated):
    return flown("courtyard", 30.0), simulated("courtyard", 30.0, flight_seed=9)


def localized(recording, prior, out):
    map_recording(recording / RECORDING, recording / PAYLOAD, out, prior_map=prior, threads=2)
    return json.loads((out / "run.json").read_text())["localization"]


@pytest.mark.parametrize("given", ["run", pytest.param("cloud", marks=pytest.mark.slow)])
def test_a_flight_is_found_in_the_map_of_another(flights, given, tmp_path):
    """The lidar's ranges have σ = 10 mm; the IMU's place along the spin axis is the payload's (5 mm)."""
    first, second = flights
    prior = first.out if given == "run" else first.out / "map.laz"
    record = localized(second, prior, tmp_path / "out")
    found = localized_score(tmp_path / "out", second, first.out, first.recording)
    assert found.across < 0.004
    assert found.along < 0.02
    assert found.map_std < 1.3 * 0.01
    if given == "run":
        assert record["appeared"] < 1e-3 * record["points"]
    assert {"appeared.laz", "disappeared.laz"} <= {p.name for p in (tmp_path / "out").iterdir()}
    assert len(read_points(tmp_path / "out" / "appeared.laz")) == record["appeared"]


def test_a_flight_somewhere_else_is_not_forced_into_the_map(flights, simulated, tmp_path):
    elsewhere = simulated("cave", 30.0)
    with pytest.raises(EstimationError, match=r"none of the \d+ places of the recording"):
        localized(elsewhere, flights[0].out, tmp_path / "out")
    record = json.loads((tmp_path / "out" / "run.json").read_text())
    assert not record["complete"]
    reasons = {c["reason"] for c in record["localization"]["candidates"]}
    assert None not in reasons
    assert (tmp_path / "out" / "odometry.txt").exists()
