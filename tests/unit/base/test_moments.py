# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np

from bentwing.base.moments import Moments, Planes, VoxelMoments
from bentwing.base.voxels import voxel_keys


def test_moments_of_voxels_are_those_of_their_points():
    rng = np.random.default_rng(0)
    points = rng.uniform(-3, 3, (20_000, 3))
    voxels = VoxelMoments(1.0)
    for part in np.array_split(points, 9):
        voxels.add(part)
    found = voxels.result()
    keys = voxel_keys(points, 1.0)
    assert found.counts.sum() == len(points)
    for i, key in enumerate(np.unique(keys)):
        own = points[keys == key]
        assert found.counts[i] == len(own)
        assert np.allclose(found.means[i], own.mean(axis=0))
        assert np.allclose(found.covariances[i], np.cov(own.T, bias=True))


def test_moments_of_coarser_voxels_come_from_those_of_finer_ones():
    points = np.random.default_rng(1).uniform(-3, 3, (5_000, 3))
    fine, coarse, expected = VoxelMoments(0.5), VoxelMoments(1.0), VoxelMoments(1.0)
    fine.add(points)
    coarse.add_moments(fine.result())
    expected.add(points)
    assert np.array_equal(coarse.result().counts, expected.result().counts)
    assert np.allclose(coarse.result().covariances, expected.result().covariances, atol=1e-14)


def test_groups_of_points_have_their_own_moments():
    points = np.random.default_rng(2).normal(1e4, 1.0, (60, 3))
    found = Moments.of_groups(points, np.array([0, 10, 25]))
    for i, own in enumerate(np.split(points, [10, 25])):
        assert found.counts[i] == len(own)
        assert np.allclose(found.means[i], own.mean(axis=0), rtol=1e-15)
        assert np.allclose(found.covariances[i], np.cov(own.T, bias=True), rtol=0, atol=1e-9)


def test_a_plane_has_the_normal_thickness_and_width_of_its_points():
    rng = np.random.default_rng(3)
    normal, along = np.array([0.6, 0.0, 0.8]), np.array([0.8, 0.0, -0.6])
    extents = rng.normal(0, [[0.01, 0.5, 2.0]], (20_000, 3))
    points = extents @ np.stack([normal, along, [0.0, 1.0, 0.0]])
    planes = Planes.of(np.cov(points.T, bias=True)[None])
    assert abs(planes.normals[0] @ normal) > 1 - 1e-4
    assert np.allclose([planes.thickness[0], planes.width[0]], [0.01, 0.5], rtol=0.02)


def test_discs_are_planar_and_lines_and_balls_are_not():
    disc, line, ball = np.diag([0.0, 1.0, 1.0]), np.diag([0.0, 0.0, 1.0]), np.eye(3)
    planarity = Planes.of(np.stack([disc, line, ball])).planarity
    assert np.allclose(planarity, [1.0, 0.0, 0.0], atol=1e-15)
