# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np

from bentwing.map.mixed_pixels import mixed_pixels

STEP = np.radians(0.25)


def scan(ranges, start=0.0):
    angles = -1.0 + STEP * np.arange(len(ranges))
    points = np.stack([ranges * np.cos(angles), ranges * np.sin(angles), 0 * angles], axis=1)
    return points, start + 17e-6 * np.arange(len(ranges))


def doubtful(points, times, ring=None):
    return mixed_pixels(points, np.linalg.norm(points, axis=1), times, ring)


def edge_with_veil():
    ranges = np.full(200, 8.0)
    ranges[:100] = 3.0
    ranges[100] = 5.5
    return ranges + 0.01 * np.random.default_rng(0).normal(size=200)


def test_the_return_between_a_pillar_and_the_wall_behind_is_doubtful():
    assert np.flatnonzero(doubtful(*scan(edge_with_veil()))).tolist() == [100]


def test_every_ring_is_a_scan_line_of_its_own():
    one = edge_with_veil()
    points, times = scan(np.repeat(one, 2))
    angles = -1.0 + STEP * (np.arange(400) // 2)
    points[:, 0], points[:, 1] = (np.repeat(one, 2) * f(angles) for f in (np.cos, np.sin))
    ring = np.tile(np.array([3, 7], np.uint16), 200)
    assert np.flatnonzero(doubtful(points, times, ring)).tolist() == [200, 201]


def test_a_floor_seen_at_a_grazing_angle_is_not_doubtful():
    depression = np.radians(4.0) + STEP * np.arange(60)
    ranges = 1.5 / np.sin(depression)
    assert np.abs(np.diff(ranges)).max() > 1.0
    points = np.stack([ranges * np.cos(depression), 0 * ranges, -1.5 + 0 * ranges], axis=1)
    assert not doubtful(points, 17e-6 * np.arange(60.0)).any()


def test_a_wire_before_a_wall_is_not_doubtful():
    ranges = np.full(100, 6.0)
    ranges[50] = 4.0
    assert not doubtful(*scan(ranges)).any()


def test_returns_of_different_scans_are_no_neighbours():
    points, times = scan(edge_with_veil())
    times[100:] += 0.01
    assert not doubtful(points, times).any()


def test_few_returns_are_not_doubtful():
    for n in range(6):
        assert not doubtful(*scan(np.full(n, 3.0))).any()
