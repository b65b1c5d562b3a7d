# SPDX-License-Identifier: MIT OR Apache-2.0
import base64
import json
import re

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.report import scene as rooms
from bentwing.report.scene import scene
from bentwing.report.stretches import degenerate
from bentwing.report.views import ceiling_of

WINDOWS = [{"time": t, "degenerate": t == 3.0} for t in (1.0, 2.0, 3.0, 4.0)]


def path(n=50):
    times = np.linspace(0.0, 4.0, n)
    positions = np.column_stack([times, np.sin(times), np.full(n, 1.5)])
    return Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)))


def data_of(html):
    return json.loads(re.search(r'<script type="application/json">(.*?)</script>', html)[1])


def decoded(text, dtype):
    return np.frombuffer(base64.b64decode(text), dtype)


def test_points_and_path_are_kept_to_a_step():
    rng = np.random.default_rng(0)
    points, times = rng.uniform([-5, 0, -1], [15, 8, 4], (5000, 3)), np.linspace(0, 4, 5000)
    data = data_of(scene(points, times, path(), WINDOWS))
    origin, step = np.array(data["origin"]), data["step"]
    shown = origin + step * decoded(data["points"], "<u2").reshape(-1, 3)
    assert step < 20.0 / 60_000
    assert len(shown) > 0.98 * len(points)
    nearest = np.abs(shown[::500, None] - points[None]).max(axis=2).min(axis=1)
    assert nearest.max() <= 0.51 * step
    way = origin + step * decoded(data["path"], "<u2").reshape(-1, 3)
    assert np.abs(way - path().positions).max() <= 0.51 * step
    height, time = data["colours"]
    assert "codes" not in height
    ages = decoded(time["codes"], np.uint8)
    assert (ages[0], ages[-1]) == (0, 254)


def test_points_are_coloured_by_what_is_known_of_them():
    rng = np.random.default_rng(3)
    points = rng.uniform(0, 4, (5000, 3))
    sigma = np.where(points[:, 0] < 2.0, np.nan, 0.001 * points[:, 1]).astype(np.float32)
    angle = np.radians(90 * points[:, 2] / 4).astype(np.float32)
    values = np.column_stack([sigma, np.full(5000, 7.0, np.float32), angle])
    data = data_of(scene(points, np.linspace(0, 4, 5000), path(), values=values))
    found = {one["name"]: one for one in data["colours"]}
    # An intensity that is the same everywhere is no colour.
    assert list(found) == ["height", "time", "sigma", "incidence"]
    shown = data["origin"] + data["step"] * decoded(data["points"], "<u2").reshape(-1, 3)
    for name, expected in (("sigma", shown[:, 1]), ("incidence", 90 * shown[:, 2] / 4)):
        one = found[name]
        codes = decoded(one["codes"], np.uint8)
        low, high = one["range"]
        known = codes < 255
        assert np.array_equal(known, shown[:, 0] >= 2.0) if name == "sigma" else known.all()
        told = low + (high - low) * codes[known] / 254
        off = np.abs(told - np.clip(expected[known], low, high))
        assert off.max() < 0.6 * (high - low) / 254 + 0.01 * high


def test_the_path_is_marked_where_a_direction_was_unseen():
    found = degenerate(np.array([0.5, 1.5, 2.1, 2.9, 3.0, 3.5, 9.0]), WINDOWS)
    assert found.tolist() == [False, False, True, True, True, False, False]
    assert not degenerate(np.array([1.0]), []).any()


def test_many_points_are_thinned(monkeypatch):
    monkeypatch.setattr(rooms, "N_POINTS", 100)
    points = np.random.default_rng(1).uniform(0, 1, (1001, 3))
    data = data_of(scene(points, np.arange(1001.0), path()))
    shown = decoded(data["points"], "<u2").reshape(-1, 3) * data["step"]
    assert 20 <= len(shown) <= 100
    # Evenly in space: no two points share a voxel, so few are very near to each other.
    apart = np.linalg.norm(shown[:, None] - shown[None], axis=2) + np.eye(len(shown))
    assert np.median(apart.min(axis=1)) > 0.05


def test_the_view_is_cut_below_a_ceiling_at_first():
    points = np.random.default_rng(1).uniform([0, 0, 0], [4, 4, 3], (5000, 3))
    cut, open_air = (
        data_of(scene(points, np.linspace(0, 4, 5000), path(), ceiling=c)) for c in (2.4, None)
    )
    assert cut["cut"] == 2.4
    assert open_air["cut"] == open_air["high"][2]


def test_a_ceiling_is_where_most_overhead_points_are():
    rng = np.random.default_rng(2)
    walls, roof = rng.uniform(1.8, 2.6, 1000), rng.normal(2.6, 0.01, 1000)
    assert 2.3 < ceiling_of(np.concatenate([walls, roof])) < 2.55
    assert ceiling_of(np.empty(0)) is None


@pytest.mark.parametrize("n", [1, 2])
def test_hardly_any_points_make_a_scene(n):
    empty = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
    data = data_of(scene(np.ones((n, 3)), np.zeros(n), empty))
    assert data["radius"] > 0
    assert data["path"] == ""
