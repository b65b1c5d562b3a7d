# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import InputError
from bentwing.closing.localize import read_prior_map
from bentwing.closing.localize.map_surfels import SurfelMaker
from bentwing.map.chunk import untimed
from bentwing.map.writer import open_map
from bentwing.odometry.continuous.settings import SurfelSettings

WALL = 0.1  # m, thickness


def wall(x, rng, n=200_000):
    return np.column_stack([np.full(n, x), rng.uniform(-2, 2, n), rng.uniform(0, 2, n)])


def levels(*parts):
    maker = SurfelMaker(SurfelSettings())
    for points, origin in parts:
        maker.add(points, None if origin is None else np.broadcast_to(origin, points.shape))
    return maker.levels()


def test_the_two_sides_of_a_wall_stay_apart():
    rng = np.random.default_rng(1)
    found = levels((wall(0.0, rng), [-3.0, 0.3, 1.0]), (wall(WALL, rng), [3.0, 0.3, 1.0]))
    assert [level.voxel_size for level in found] == [0.4, 0.8, 1.6, 3.2]
    for level in found:
        front = level.normals[:, 0] < 0
        assert np.allclose(np.abs(level.normals[:, 0]), 1.0)
        assert np.allclose(level.means[front, 0], 0.0, atol=1e-9)
        assert np.allclose(level.means[~front, 0], WALL, atol=1e-9)


def test_a_surface_seen_from_nobody_knows_where_has_both_normals():
    (finest, *_) = levels((wall(0.0, np.random.default_rng(1)), None))
    front = finest.normals[:, 0] < 0
    assert front.sum() == (~front).sum() == len(np.unique(finest.means, axis=0))


def test_parts_of_a_cloud_make_the_surfels_of_the_whole():
    points = wall(1.3, np.random.default_rng(1))
    whole, parts = levels((points, None)), levels(*((p, None) for p in np.array_split(points, 7)))
    for a, b in zip(whole, parts, strict=True):
        assert np.allclose(a.means, b.means)
        assert np.allclose(a.covariances, b.covariances)


def test_a_cloud_without_surfaces_is_refused(tmp_path):
    path = tmp_path / "dust.ply"
    with open_map(path, "ply", 0) as writer:
        writer.write(untimed(np.random.default_rng(1).uniform(-500, 500, (5000, 3))))
    with pytest.raises(InputError, match="5000 points hold no surfaces"):
        read_prior_map(path, SurfelSettings())
