# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finished runs as pictures and reports read them."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.report.finished import ShownRun
from support.finished_runs import finished_run, flight


def test_points_come_back_as_they_were_measured(tmp_path):
    rng = np.random.default_rng(101)
    points = rng.uniform(-20.0, 20.0, (500, 3))
    shift = rng.normal(0.0, 0.01, 500).astype(np.float32)
    refined = ShownRun.open(finished_run(tmp_path / "run", points, shift=shift))
    ((read, times),) = refined.parts(measured=True)
    beams = points - flight().interpolate(times)[0]
    beams /= np.linalg.norm(beams, axis=1)[:, None]
    assert read == pytest.approx(points - beams * shift[:, None], abs=2e-3)
    along = ((points - read) * beams).sum(axis=1)
    assert along == pytest.approx(shift, abs=1.5e-3)  # coordinates are in whole millimetres


def test_points_of_a_run_that_moved_none_stay(tmp_path):
    points = np.random.default_rng(102).uniform(-20.0, 20.0, (100, 3))
    ((read, _),) = ShownRun.open(finished_run(tmp_path / "run", points)).parts(measured=True)
    assert read == pytest.approx(points, abs=1e-3)
