# SPDX-License-Identifier: MIT OR Apache-2.0
"""A site is mapped, and flown again a month later, when things stand elsewhere: the commands of docs/another_day.md."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base.trajectory import read_tum
from bentwing.base.transform import apply, from_poses
from bentwing.evaluate.simulated import localized_score
from bentwing.simulate import Scenario
from bentwing.simulate.simulation import prepare

pytestmark = pytest.mark.slow

WORLD = {"scene": "courtyard", "seed": 104, "duration": 30.0}
BOXES = 4


def command_of(flight_seed, out):
    return (
        *("simulate", WORLD["scene"], "--seed", WORLD["seed"], "--duration", WORLD["duration"]),
        *("--flight-seed", flight_seed, "--boxes", BOXES, "-o", out, "--quiet"),
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("another_day")


@pytest.fixture
def may(folder, bentwing):
    """The recording of the first day, and its map."""
    recording, site = folder / "may", folder / "site"
    if not site.exists():
        assert bentwing(*command_of(1, recording)).code == 0
        said = bentwing(
            "map", recording / "recording.bag", "-p", recording / "payload.yaml", "-o", site
        )
        assert said.code == 0, said.err
    return recording, site


@pytest.fixture
def june(may, folder, bentwing):
    """The recording of the other day, the run that was found in the map, and what was said of it."""
    recording, later = folder / "june", folder / "later"
    if not later.exists():
        assert bentwing(*command_of(2, recording)).code == 0
        said = bentwing(*localize(recording, may[1], later))
        assert said.code == 0, said.err
        (folder / "said.txt").write_text(said.out)
    return recording, later, (folder / "said.txt").read_text()


def localize(recording, prior, out):
    payload = recording / "payload.yaml"
    return "localize", recording / "recording.bag", "--map", prior, "-p", payload, "-o", out


def boxes_of(flight_seed):
    """Boxes (B, 8, 3) of a flight, in the simulated world."""
    empty, full = (
        prepare(Scenario(**WORLD, flight_seed=flight_seed, boxes=n)).world.site.mesh.vertices
        for n in (0, BOXES)
    )
    return full[len(empty) :].reshape(-1, 8, 3)


def to_world(recording, site):
    """T_world_map of the map of a recording."""
    truth, _ = read_tum(recording / "truth_trajectory.txt")
    found, _ = read_tum(site / "trajectory.txt")
    pairs = [(one.positions[0], one.quats_xyzw[0]) for one in (truth, found)]
    T_world, T_map = (from_poses(p[None], q[None])[0] for p, q in pairs)
    return T_world @ np.linalg.inv(T_map)


def test_the_later_flight_is_where_it_was_flown(may, june):
    score = localized_score(june[1], june[0], may[1], may[0])
    assert score.across < 0.005
    assert score.along < 0.02


def test_boxes_that_are_gone_have_disappeared_and_no_other_area_has(may, june):
    """An area is at most a box's half diagonal, 0.8 m, from its middle."""
    record = json.loads((june[1] / "run.json").read_text())["localization"]
    T = to_world(*may)
    centres = {
        kind: apply(
            T, np.array([a["centre"] for a in record["changed_areas"] if a["kind"] == kind])
        )
        for kind in ("appeared", "disappeared")
    }
    for kind, flight_seed in (("appeared", 2), ("disappeared", 1)):
        middles = boxes_of(flight_seed).mean(axis=1)
        off = np.linalg.norm(centres[kind][:, None, :2] - middles[None, :, :2], axis=2)
        assert (off.min(axis=1) < 0.8).all(), f"{kind} where no box is"
        if kind == "disappeared":
            assert (off.min(axis=0) < 0.8).all()  # all of them were in sight
    assert len(centres["appeared"]) > 0


def test_the_command_says_how_much_has_changed_and_the_report_shows_it(june):
    _, later, said = june
    assert "changed since the map was made: " in said
    assert "4 disappeared" in said
    page = (later / "report.html").read_text()
    assert "Changed area" in page


def test_a_courtyard_with_other_things_is_refused_with_a_sentence(may, folder, bentwing):
    twin = folder / "twin"
    command = command_of(3, twin)
    assert bentwing(*command, "--things-seed", 9).code == 0
    said = bentwing(*localize(twin, may[1], folder / "of_twin"))
    assert said.code == 4
    assert "of the recording was recognized among" in said.err
    candidates = json.loads((folder / "of_twin/run.json").read_text())["localization"]["candidates"]
    assert any("faces of things" in (c["reason"] or "") for c in candidates)
