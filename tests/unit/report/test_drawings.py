# SPDX-License-Identifier: MIT OR Apache-2.0
import struct
import zlib
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.trajectory import Trajectory
from bentwing.report.colours import HEIGHT, colour
from bentwing.report.picture import encode_png, project, render, render_top, write_png
from bentwing.report.plot import Series, line_plot
from bentwing.report.svg import nice_ticks
from bentwing.report.views import overhead_points
from bentwing.report.wall import HEIGHT as HEIGHT_OF_PANEL
from bentwing.report.wall import MEANS, draw_wall


def decoded(png):
    width, height = struct.unpack(">II", png[16:24])
    data, at = b"", 8
    while at < len(png):
        (size,) = struct.unpack(">I", png[at : at + 4])
        body = png[at + 4 : at + 8 + size]
        assert struct.unpack(">I", png[at + 8 + size : at + 12 + size])[0] == zlib.crc32(body)
        data += body[4:] if body[:4] == b"IDAT" else b""
        at += 12 + size
    rows = np.frombuffer(zlib.decompress(data), np.uint8).reshape(height, 1 + 3 * width)
    assert (rows[:, 0] == 2).all()
    return np.cumsum(rows[:, 1:].reshape(height, width, 3), axis=0, dtype=np.uint8)


def test_png_holds_the_picture(tmp_path):
    image = np.random.default_rng(0).integers(0, 256, (37, 21, 3)).astype(np.uint8)
    assert np.array_equal(decoded(encode_png(image)), image)
    write_png(tmp_path / "p.png", image)
    assert (tmp_path / "p.png").read_bytes() == encode_png(image)


def test_two_views_of_a_wall_are_drawn_apart_before_and_together_after(tmp_path):
    along = np.linspace(-2.0, 2.0, 600)
    halves = np.arange(600) % 2
    shifted = np.where(halves == 0, 0.03, -0.03)
    draw_wall(
        tmp_path / "wall.png", (along, along), (shifted, 0 * along), (halves, halves), (0.06, 0.0)
    )
    image = decoded((tmp_path / "wall.png").read_bytes())
    before, after = np.split(image.astype(int), 2)
    rows = [np.flatnonzero((before == mean).all(axis=2).any(axis=1)).mean() for mean in MEANS]
    # 6 cm of the 24 that are shown
    assert rows[1] - rows[0] == pytest.approx(0.06 / 0.24 * HEIGHT_OF_PANEL, abs=2)
    # What is drawn last hides what is at the same place.
    assert not (after == MEANS[0]).all(axis=2).any()
    assert (after == MEANS[1]).all(axis=2).any(axis=1).sum() == 3


def test_the_point_nearest_to_the_viewer_is_seen():
    x = np.zeros(2)
    view = render(x, x, np.array([1.0, 5.0]), np.array([0.0, 1.0]), close_gaps=0, shading=0.0)
    seen = view.image[(view.image < 255).any(axis=2)]
    assert np.array_equal(seen, colour(np.array([1.0]), HEIGHT).astype(np.uint8))


def test_every_pixel_has_the_nearest_of_its_points_and_of_equals_the_last():
    rng = np.random.default_rng(1)
    across, up = rng.uniform(0, 1, (2, 2000))
    across[0] = 1e9  # falls off the picture
    toward = rng.integers(0, 5, 2000).astype(float)
    seen = project(across, up, toward, width=20, max_height=20, close_gaps=0)
    expected = np.full_like(seen.front, -1)
    for i in np.argsort(toward, kind="stable"):
        row, column = (
            int((seen.top - up[i]) / seen.pixel),
            int((across[i] - seen.left) / seen.pixel),
        )
        if max(row, column) < 21:
            expected[row, column] = i
    assert np.array_equal(seen.front, expected)


def test_metres_in_the_picture_are_metres_in_the_map():
    corners = np.array([[0.0, 0, 0], [30, 0, 0], [0, 20, 0], [30, 20, 0]])
    points = np.repeat(corners, 10, axis=0)
    view = render(*points.T, points[:, 2], width=500, max_height=500, close_gaps=0)
    rows, columns = np.nonzero((view.image < 255).any(axis=2))
    assert np.ptp(columns) * view.pixel == pytest.approx(30, abs=2 * view.pixel)
    assert np.ptp(rows) * view.pixel == pytest.approx(20, abs=2 * view.pixel)
    assert max(view.image.shape[:2]) <= 501


def test_the_picture_from_above_has_y_upwards():
    points = np.array([[0.0, 0.0, 0.0]] * 10 + [[0.0, 10.0, 5.0]] * 10)
    image = render_top(points, width=100, max_height=100)
    rows, columns = np.nonzero((image < 255).any(axis=2))
    top, bottom = image[rows.min(), columns[0]], image[rows.max(), columns[0]]
    assert top[0] > bottom[0]  # the high point is yellow


def test_edges_of_depth_are_darker_than_flat_ground():
    x, y = (a.ravel() for a in np.meshgrid(np.arange(100) * 0.1, np.arange(100) * 0.1))
    z = np.where(x < 5, 0.0, 3.0)
    view = render(x, y, z, np.zeros_like(z), width=100, max_height=100)
    brightness = view.image.sum(axis=2).astype(float)
    step = int((5 - view.left) / view.pixel)
    assert brightness[50, step - 2] < 0.8 * brightness[50, step - 30]


def test_no_point_gives_an_empty_picture():
    assert (render_top(np.empty((0, 3))) == 255).all()


def test_points_above_the_sensor_are_left_out_only_under_a_roof():
    rng = np.random.default_rng(0)
    trajectory = Trajectory(
        np.array([0.0, 1.0]), np.array([[0, 0, 1.0], [1, 0, 1.0]]), np.tile([0.0, 0, 0, 1], (2, 1))
    )
    floor = rng.uniform([-5, -5, -0.01], [5, 5, 0.01], (1000, 3))
    roof = np.add(floor, [0, 0, 2.5])
    times = rng.uniform(0, 1, 2000)
    marked = overhead_points(np.vstack([floor, roof]), times, trajectory)
    assert np.array_equal(marked, np.arange(2000) >= 1000)
    far_wall = rng.uniform([20, -5, 0], [20.1, 5, 8], (1000, 3))
    assert not overhead_points(np.vstack([floor, far_wall]), times, trajectory).any()


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e6), st.integers(1, 10))
def test_ticks_are_round_rising_and_inside(low, span, n):
    ticks = nice_ticks(low, low + span, n)
    assert 1 <= len(ticks) <= 2 * n + 2
    assert all(b > a for a, b in pairwise(ticks))
    assert low - span <= ticks[0]
    assert ticks[-1] <= low + 2 * span


def test_a_long_line_is_thinned_but_keeps_its_peaks():
    y = np.zeros(200_000)
    y[123_456] = 7.0
    text = line_plot([Series("a", np.arange(200_000.0), y)], "x", "y")
    assert len(text) < 60_000
    heights = [float(p.split(",")[1]) for p in text.split('points="')[1].split('"')[0].split()]
    assert max(heights) - min(heights) > 100


def test_a_line_without_numbers_says_so():
    assert "Not recorded" in line_plot([Series("a", np.arange(3.0), np.full(3, np.nan))], "x", "y")
