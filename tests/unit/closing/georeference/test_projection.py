# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np

from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.closing.georeference.placement import Placement
from bentwing.closing.georeference.projection import MAX_ERROR, MapProjection
from bentwing.map.read import _in_map_frame

FRAME = LevelFrame(9.8, 48.1, 520.0)
PLACED = Placement(2.1, np.array([12.0, -40.0, 3.0]), np.zeros(4))
UTM = ProjectedSystem.of_epsg(32632)


def over(size):
    half = np.array([size, size, 60.0])
    return MapProjection.over(-half, half, FRAME, PLACED, UTM)


def anywhere(size, n=500):
    return np.random.default_rng(0).uniform(-1, 1, (n, 3)) * [size, size, 60.0]


def test_the_polynomial_is_as_good_as_it_says_over_kilometres():
    for size in (50.0, 1000.0, 5000.0):
        made = over(size)
        points = anywhere(size)
        error = np.abs(made.to_projected(points) - made.exact(points)).max()
        assert error < 2e-8 + 1.5 * made.error
        assert error < MAX_ERROR


def test_what_the_polynomial_cannot_follow_is_projected_point_by_point():
    made = over(200_000.0)
    assert made.error > MAX_ERROR
    points = anywhere(200_000.0, 20)
    assert np.array_equal(made.to_projected(points), made.exact(points))


def test_lengths_are_those_of_the_grid_and_north_is_turned():
    made = over(500.0)
    ends = made.to_projected(np.array([[0.0, 0, 0], [400.0, 0, 0]]))
    way = (ends[1] - ends[0])[:2]
    scale = UTM.factors(9.8, 48.1)[1] * (1 - 520 / 6.378e6)
    assert np.isclose(np.linalg.norm(way), 400 * scale, atol=2e-3)
    assert abs(np.linalg.norm(way) - 400) > 0.05
    convergence = np.radians(UTM.factors(9.8, 48.1)[0])
    heading = np.arctan2(way[1], way[0])
    assert np.isclose(np.angle(np.exp(1j * (heading - 2.1 - convergence))), 0, atol=1e-4)


def test_the_way_back_is_exact_and_the_linear_one_good_nearby():
    made = over(300.0)
    points = anywhere(150.0)
    there = made.to_projected(points)
    assert np.allclose(made.to_map(there), points, atol=1e-6)
    assert np.abs(_in_map_frame(there, made.record()) - points).max() < 0.005
