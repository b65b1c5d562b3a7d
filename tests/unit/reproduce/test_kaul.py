# SPDX-License-Identifier: MIT OR Apache-2.0
"""Parts of the reproduction that need no flight."""

import json

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.drift_boxes import DriftBoxes
from bentwing.evaluate.evaluation import DriftOver, Evaluation
from bentwing.evaluate.statistics import Box
from bentwing.reproduce import parts
from bentwing.reproduce.figure import Assignment, Compared, Figure, Part
from bentwing.reproduce.kaul_table import drift_rows
from bentwing.reproduce.loop_stages import moved, with_drift


def circle(n=400):
    times = np.linspace(0.0, 40.0, n)
    turn = 2 * np.pi * times / 40.0
    places = 5 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1)
    return Trajectory(times, places, geometry.exp(np.outer(turn, [0.0, 0.0, 1.0])))


def test_drift_is_put_in_and_grows_along_the_way():
    true = circle()
    drifted = with_drift(true)
    off = np.linalg.norm(drifted.positions - true.positions, axis=1)
    assert off[0] == 0.0
    assert off[-1] > 1.0
    assert (off[100], off[200]) < (off[200], off[-1])
    turn = geometry.multiply(drifted.quats_xyzw[-1], geometry.inverse(true.quats_xyzw[-1]))
    assert np.isclose(np.degrees(np.linalg.norm(geometry.log(turn))), 12.0)


def test_points_follow_the_trajectory_they_were_measured_from():
    true = circle()
    drifted = with_drift(true)
    rng = np.random.default_rng(0)
    times = rng.uniform(0, 40, 50)
    seen = rng.uniform(-3, 3, (50, 3))  # from the sensor
    before, after = (geometry.compose(*t.interpolate(times), seen) for t in (true, drifted))
    np.testing.assert_allclose(moved(before, times, true, drifted), after, atol=1e-9)


def measured(horizontal):
    """A flight with a box of drift per length; only what the rows of drift need."""

    def box(width):
        return Box(-width, -width / 2, 0.0, width / 2, width, 0.0, width, 100)

    lengths = [
        DriftBoxes(length, 100, box(h), box(5e-5), box(1e-5), box(1e-5))
        for length, h in horizontal.items()
    ]
    evaluation = Evaluation(drift=DriftOver("odometry", "trajectory", lengths))
    return type("Measured", (), {"evaluation": evaluation, "against_truth": lengths})()


def test_an_aim_holds_for_every_length_of_the_way():
    good = drift_rows("yard", measured({5.0: 8e-4, 50.0: 1e-4}))
    bad = drift_rows("yard", measured({5.0: 2e-4, 20.0: 1.2e-3, 50.0: 1e-4}))
    assert [row.met for row in good] == [True, True, True, True]
    assert [row.met for row in bad] == [False, True, True, True]
    assert "0.8 over 5 m, 0.1 over 50 m" in good[0].ours
    assert "1.2 over 20 m" in bad[0].ours


def test_the_page_has_the_comparison_and_the_figures(tmp_path, monkeypatch):
    def part(assignment: Assignment) -> Part:
        drawing = '<svg viewBox="0 0 10 10" role="img" aria-label="x"></svg>'
        rows = [Compared("spacing <mm>", "10", str(assignment.seed), "≤ 9", met=False)]
        return Part(
            "A part", [Figure("fig1", drawing, "Fig. 1", "a & b")], {"n": np.float64(2)}, rows
        )

    monkeypatch.setitem(parts.PARTS, "someone2000", {"only": part})
    written = parts.reproduce("someone2000", tmp_path / "out", quick=True, seed=7)
    page = written.page.read_text()
    for text in ("spacing &lt;mm&gt;", "missed", "a &amp; b", "seed 7", "quick"):
        assert text in page, text
    assert {p.name for p in (tmp_path / "out").iterdir()} == {
        "report.html",
        "only.json",
        "fig1.png",
        "fig1.svg",
    }
    assert json.loads((tmp_path / "out" / "only.json").read_text()) == {"n": 2.0}
