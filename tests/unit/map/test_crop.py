# SPDX-License-Identifier: MIT OR Apache-2.0
"""Crops keep what is inside and nothing else, compared with the plainest formulas."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.map.chunk import MapChunk
from bentwing.map.crop import Crop, Cropper
from bentwing.map.polygon import Polygon, contained

SQUARE = [[0, 0], [4, 0], [4, 4], [0, 4]]
HOLE = [[1, 1], [3, 1], [3, 3], [1, 3]]


def points_of(seed, n=400, reach=6.0):
    return np.random.default_rng(seed).uniform(-reach, reach, (n, 3))


def winding_of(ring, point):
    """How often a ring goes around a point, by the angles of its corners."""
    offsets = np.asarray(ring, float) - point
    angles = np.arctan2(offsets[:, 1], offsets[:, 0])
    turns = np.diff(np.append(angles, angles[0]))
    return round(float(np.sum((turns + np.pi) % (2 * np.pi) - np.pi) / (2 * np.pi)))


@given(st.integers(0, 10_000), st.integers(3, 9))
def test_a_ring_contains_what_its_angles_go_around_an_odd_number_of_times(seed, n_corners):
    ring = np.random.default_rng(seed).uniform(-5, 5, (n_corners, 2))
    points = points_of(seed + 1, 60)[:, :2]
    expected = [winding_of(ring, point) % 2 == 1 for point in points]
    assert Polygon((ring,)).contains(points).tolist() == expected


@given(st.integers(0, 10_000))
def test_two_areas_with_one_border_divide_all_points_on_it(seed):
    along = np.random.default_rng(seed).integers(1, 4, 20).astype(float)
    border = np.column_stack([np.full(20, 2.0), along])
    left = Polygon.of([[0, 0], [2, 0], [2, 4], [0, 4]])
    right = Polygon.of([[2, 0], [4, 0], [4, 4], [2, 4]])
    assert np.all(left.contains(border) ^ right.contains(border))


def test_a_hole_is_outside_and_several_areas_are_a_union():
    ring, hole = Polygon.of(SQUARE, HOLE), Polygon.of(HOLE)
    points = np.array([[0.5, 0.5], [2.0, 2.0], [5.0, 2.0]])
    assert ring.contains(points).tolist() == [True, False, False]
    assert contained([ring, hole], points).tolist() == [True, True, False]
    # areas that overlap stay whole, as no ring of the one is a hole of the other
    assert contained([Polygon.of(SQUARE), hole], points).tolist() == [True, True, False]


def test_a_ring_may_end_where_it_began():
    assert Polygon.of([*SQUARE, SQUARE[0]]) == Polygon.of(SQUARE)


@pytest.mark.parametrize("rings", [(), ([[0, 0], [1, 1]],), ([[0, 0], [1, np.nan], [1, 1]],)])
def test_what_is_no_area_is_refused(rings):
    with pytest.raises(ValueError, match="rings"):
        Polygon.of(*rings)


@given(st.integers(0, 10_000))
def test_a_crop_keeps_what_every_limit_keeps(seed):
    rng, points = np.random.default_rng(seed), points_of(seed)
    times = np.sort(rng.uniform(0, 100, len(points)))
    path = rng.uniform(-3, 3, (50, 3))
    low, high = np.sort(rng.uniform(-6, 6, (2, 3)), axis=0)
    crop = Crop(
        box=(*low, *high),
        area=Polygon.of(SQUARE),
        heights=(-4.0, 4.0),
        times=(20.0, 80.0),
        within=2.5,
    )
    expected = np.all((points >= low) & (points <= high), axis=1)
    expected &= np.all((points[:, :2] >= 0) & (points[:, :2] < 4), axis=1)
    expected &= (abs(points[:, 2]) <= 4) & (times >= 20) & (times <= 80)
    distances = np.linalg.norm(points[:, None] - path, axis=2).min(axis=1)
    assert np.array_equal(Cropper(crop, path).keep(points, times), expected & (distances <= 2.5))


@given(st.integers(0, 10_000), st.floats(0.05, 8.0))
def test_what_is_near_a_path_is_near_one_of_its_poses(seed, within):
    points, rng = points_of(seed), np.random.default_rng(seed)
    # a flight, with poses much nearer to each other than the limit is long
    path = np.cumsum(rng.normal(0, 0.1, (300, 3)), axis=0)
    kept = Cropper(Crop(within=within), path).keep(points, np.zeros(len(points)))
    distances = np.linalg.norm(points[:, None] - path, axis=2).min(axis=1)
    # poses are left out that are nearer to each other than a share of the limit
    assert np.all(kept[distances <= within * 0.995])
    assert not np.any(kept[distances > within])


def test_borders_belong_to_boxes_heights_and_times():
    points, times = np.array([[0.0, 0, 0], [1, 1, 1], [1.001, 1, 1]]), np.array([1.0, 2.0, 2.5])
    keep = Cropper(Crop(box=(0, 0, 0, 1, 1, 1), heights=(0, 1), times=(1, 2))).keep(points, times)
    assert keep.tolist() == [True, True, False]


def test_what_is_left_out_is_counted_and_empty_chunks_are_not_passed_on():
    points = np.array([[0.0, 0, 0], [5, 5, 5], [6, 6, 6]])
    parts = [
        MapChunk(p[None], np.zeros(1), np.ones(1, np.float32), ring=np.array([7], np.uint16))
        for p in points
    ]
    counts = {}
    kept = list(Cropper(Crop(heights=(-1, 1))).chunks(parts, counts))
    assert [chunk.ring.tolist() for chunk in kept] == [[7]]
    assert counts == {"map.cropped": 2}


@pytest.mark.parametrize(
    ("limits", "named"),
    [
        ({"box": (1, 0, 0, 0, 1, 1)}, "box"),
        ({"heights": (2, 1)}, "heights"),
        ({"times": (0, np.nan)}, "times"),
        ({"within": 0.0}, "within"),
        ({"within": np.inf}, "within"),
        ({"box": (1, 2, 3)}, "box"),
        ({"area": ()}, "area"),
    ],
)
def test_limits_that_cannot_be_are_refused_by_name(limits, named):
    with pytest.raises(ValueError, match=named):
        Crop(**limits)


def test_the_bounds_of_a_crop_are_those_of_all_its_limits():
    low, high = Crop(box=(-9, 1, -9, 9, 9, 9), area=Polygon.of(SQUARE), heights=(0, 99)).bounds
    assert (low.tolist(), high.tolist()) == ([0, 1, 0], [4, 4, 9])
    assert not Crop()
    assert Crop(within=1.0)
