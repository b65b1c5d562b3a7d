# SPDX-License-Identifier: MIT OR Apache-2.0
"""Drawings as PNG, and figures of trajectories."""

import io

import numpy as np
import pytest
from PIL import Image

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.report.plot import Series, line_plot
from bentwing.report.raster import rasterize
from bentwing.report.views import oblique_view
from bentwing.reproduce.drawing import angles_over, positions_over


def picture(drawing):
    return np.asarray(Image.open(io.BytesIO(rasterize(drawing))).convert("RGB"), np.float64)


def track(n=400, shift=0.0):
    times = 0.01 * np.arange(n)
    positions = np.stack([times, np.zeros(n), shift + 0.0 * times], axis=1)
    return Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)))


def test_a_line_of_a_plot_is_where_its_values_are():
    x = np.linspace(0.0, 10.0, 50)
    low, high = (
        picture(line_plot([Series("a", x, v + 0 * x)], "x", "y", top=4.0)) for v in (1.0, 3.0)
    )
    blue = [np.flatnonzero((p[:, 700, 2] - p[:, 700, 0]) > 60) for p in (low, high)]
    height = 220 * 1400 / 560
    # Between the upper and the lower margin the axis goes from 4 to 0.
    expected = [(26 + (1 - v / 4.0) * (220 - 40 - 26)) / 220 * height for v in (1.0, 3.0)]
    assert [rows.mean() for rows in blue] == pytest.approx(expected, abs=2.0)


def test_a_map_keeps_its_colours():
    rng = np.random.default_rng(1)
    points = rng.uniform(0.0, 10.0, (60_000, 3)) * [1.0, 1.0, 0.0]
    points[:, 2] = np.where(points[:, 0] > 5.0, 2.0, 0.0)
    shown = picture(oblique_view(points, points[:, 2], "height, m"))
    ink = shown[shown.min(axis=2) < 200]
    assert (ink[:, 0] > ink[:, 2] + 60).mean() > 0.2  # yellow above
    assert (ink[:, 2] > ink[:, 0] + 20).mean() > 0.2  # blue below


def test_the_same_drawing_gives_the_same_bytes_and_another_element_is_refused():
    x = np.linspace(0.0, 1.0, 9)
    drawing = line_plot([Series("a", x, x)], "x", "y")
    assert rasterize(drawing) == rasterize(drawing)
    with pytest.raises(ValueError, match="ellipse"):
        rasterize('<svg viewBox="0 0 10 10"><ellipse rx="3" ry="2"/></svg>')


def test_an_estimate_that_leaves_the_picture_ends_there():
    truth = track()
    away = Trajectory(truth.times, truth.positions + np.array([0.0, 50.0, 0.0]), truth.quats_xyzw)
    near = Trajectory(truth.times, truth.positions + np.array([0.0, 0.1, 0.0]), truth.quats_xyzw)
    _, lost, _ = positions_over(truth.times, truth, {"a": away}, "time, s")
    _, kept, _ = positions_over(truth.times, truth, {"a": near, "b": None}, "time, s")
    assert lost.count("<polyline") == 1
    assert kept.count("<polyline") == 2


def test_angles_are_drawn_in_degrees_and_without_jumps():
    n = 400
    turn = np.linspace(0.0, 2.5 * np.pi, n)
    quats = geometry.exp(np.stack([0 * turn, 0 * turn, turn], axis=1))
    truth = Trajectory(track(n).times, track(n).positions, quats)
    _, _, yaw = angles_over(truth.times, truth, {"same": truth}, "time, s")
    assert ">500<" in yaw or ">400<" in yaw
    lines = [part.split('"')[1] for part in yaw.split("<polyline points=")[1:]]
    heights = [np.array([float(p.split(",")[1]) for p in line.split()]) for line in lines]
    assert np.allclose(heights[0], heights[1], atol=0.2)
    assert np.abs(np.diff(heights[0])).max() < 20.0
