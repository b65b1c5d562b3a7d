# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finished runs as pictures and reports read them."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.map.sample import VALUES
from bentwing.report.finished import ShownRun
from support.finished_runs import finished_run, flight


def test_points_come_back_as_they_were_measured(tmp_path):
    rng = np.random.default_rng(101)
    points = rng.uniform(-20.0, 20.0, (500, 3))
    shift = rng.normal(0.0, 0.01, 500).astype(np.float32)
    refined = ShownRun.open(finished_run(tmp_path / "run", points, shift=shift))
    ((read, times, _),) = refined.sample(1)
    beams = points - flight().interpolate(times)[0]
    beams /= np.linalg.norm(beams, axis=1)[:, None]
    assert read == pytest.approx(points - beams * shift[:, None], abs=2e-3)
    along = ((points - read) * beams).sum(axis=1)
    assert along == pytest.approx(shift, abs=1.5e-3)  # coordinates are in whole millimetres


def test_points_of_a_run_that_moved_none_stay(tmp_path):
    points = np.random.default_rng(102).uniform(-20.0, 20.0, (100, 3))
    ((read, _, _),) = ShownRun.open(finished_run(tmp_path / "run", points)).sample(1)
    assert read == pytest.approx(points, abs=1e-3)


def test_a_sample_takes_every_kth_point_of_all_parts_with_what_is_known_of_it(
    tmp_path, monkeypatch
):
    monkeypatch.setattr("bentwing.map.read_las.PART", 64)
    rng = np.random.default_rng(103)
    points = rng.uniform(-20.0, 20.0, (500, 3))
    parts = list(ShownRun.open(finished_run(tmp_path / "run", points)).sample(3))
    assert len(parts) > 2
    read, _, values = (np.concatenate(part) for part in zip(*parts, strict=True))
    assert read == pytest.approx(points[::3], abs=1e-3)
    known = dict(zip(VALUES, values.T, strict=True))
    assert known["incidence"] == pytest.approx(
        np.linspace(0, 1.5, 500)[::3], abs=0.0044
    )  # half degrees
    assert known["intensity"] == pytest.approx((np.arange(500) % 200 + 2)[::3])
    assert np.isnan(known["sigma"]).all()
