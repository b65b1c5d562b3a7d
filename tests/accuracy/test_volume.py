# SPDX-License-Identifier: MIT OR Apache-2.0
"""A pile of known volume that is flown_over, mapped and measured as a user does it."""

import json

import numpy as np
import pytest

from bentwing import Run
from bentwing.cli.main import run_command
from bentwing.evaluate import simulated
from bentwing.evaluate.trajectory import absolute_error
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.scenes import SCENES
from support import pile

pytestmark = pytest.mark.slow
HALF = 4.6  # m, of the square around the pile


@pytest.fixture(scope="module")
def flown_over(tmp_path_factory):
    """Fly over the yard; the recording's folder."""
    folder = tmp_path_factory.mktemp("yard")

    def fly(seed, *, with_pile):
        out = folder / f"{seed}"
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(SCENES, "courtyard", pile.yard(with_pile=with_pile))
            simulate(Scenario(scene="courtyard", seed=seed, duration=40.0), out)
        return out

    return fly


def command(*words):
    assert run_command([str(word) for word in words]) == 0


@pytest.fixture(scope="module")
def quarry(flown_over, tmp_path_factory):
    """A run with the pile, and the recording's folder."""
    recording, out = flown_over(904, with_pile=True), tmp_path_factory.mktemp("quarry") / "run"
    command("map", recording / "recording.bag", "-p", recording / "payload.yaml", "-o", out, "-q")
    return out, recording


def write_area(run, recording, path):
    """Write the square around the pile in the coordinates of a run's map."""
    truth = simulated.Truth(recording)
    found = absolute_error(
        Run.load(run).trajectory, truth.trajectory, during=truth.flight
    ).alignment
    corners = pile.MIDDLE + HALF * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])
    local = (np.column_stack([corners, np.zeros(5)]) - found.t) @ found.R
    path.write_text(json.dumps({"type": "Polygon", "coordinates": [local[:, :2].tolist()]}))
    return path


def measured(capfd, run, area, base):
    capfd.readouterr()
    command("volume", run, "--area", area, "--base", base, "--json")
    return json.loads(capfd.readouterr().out)


@pytest.mark.parametrize("base", ["plane", "dtm"])
def test_the_volume_of_a_pile_is_right_to_half_a_percent(quarry, tmp_path, capfd, base):
    found = measured(capfd, quarry[0], write_area(*quarry, tmp_path / "area.geojson"), base)
    assert found["volume"] == pytest.approx(pile.volume(), rel=0.005)
    assert abs(found["volume"] - pile.volume()) < 2 * found["sigma"]
    assert found["measured"] > 0.99


def test_what_came_between_two_flights_is_the_pile(flown_over, tmp_path, capfd):
    """The second one is localized in the map of the first."""
    before, after = flown_over(905, with_pile=False), flown_over(906, with_pile=True)
    command(
        "map",
        before / "recording.bag",
        "-p",
        before / "payload.yaml",
        "-o",
        tmp_path / "before",
        "-q",
    )
    command("localize", after / "recording.bag", "--map", tmp_path / "before", "-p", after / "payload.yaml",
            "-o", tmp_path / "after", "-q")  # fmt: skip
    area = write_area(tmp_path / "after", after, tmp_path / "area.geojson")
    found = measured(capfd, tmp_path / "after", area, tmp_path / "before")
    assert found["volume"] == pytest.approx(pile.volume(), rel=0.005)
    assert abs(found["volume"] - pile.volume()) < 2 * found["sigma"]
