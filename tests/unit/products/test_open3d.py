# SPDX-License-Identifier: MIT OR Apache-2.0
"""What Open3D gets of maps, windows and trajectories, what comes back, and what it draws."""

from dataclasses import replace

import numpy as np
import pytest

from bentwing import export_points, read_tum, register_window
from bentwing.base.errors import UsageError
from bentwing.base.trajectory import Trajectory
from bentwing.closing.places import match_places, places_of_cloud
from bentwing.map.chunk import MapChunk
from bentwing.products import from_open3d, oriented_points, to_open3d
from support.known_points import START_NS, write_run

THERE = np.array([640_500.0, 5_333_200.0, 200.0])


@pytest.fixture
def o3d():
    # its shared libraries may be missing, too, which is an ImportError
    return pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)


def ball(n=40_000, seed=140):
    """Points on a sphere of 2 m."""
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return 2.0 * directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def inside(tmp_path_factory):
    """A run in the middle of a sphere, far from the zero of its coordinates."""
    way = np.linspace(-0.2, 0.2, 50)[:, None] * [1.0, 1.0, 0.5] + THERE
    return write_run(tmp_path_factory.mktemp("ball") / "run", ball() + THERE, way=way, settings={})


def test_a_map_becomes_a_cloud_with_all_it_has_and_comes_back(o3d, inside):
    cloud = to_open3d(inside)
    assert isinstance(cloud, o3d.t.geometry.PointCloud)
    assert np.abs(cloud.point.positions.numpy() - (ball() + THERE)).max() < 1e-4
    assert np.allclose(cloud.point["time"].numpy().ravel(), np.linspace(0, 10, 40_000), atol=1e-6)
    assert "sigma" not in cloud.point
    chunk = from_open3d(cloud)
    assert np.array_equal(chunk.points, cloud.point.positions.numpy())
    assert (chunk.ranges == 1.0).all()
    assert chunk.sigma is None


def test_columns_and_normals_are_attributes(o3d, inside):  # noqa: ARG001
    rng = np.random.default_rng(142)
    chunk = MapChunk(
        rng.normal(size=(9, 3)) + THERE,
        rng.uniform(size=9),
        rng.uniform(size=9).astype(np.float32),
        intensity=rng.uniform(size=9).astype(np.float32),
        sigma=rng.uniform(size=9).astype(np.float32),
        ring=np.arange(9, dtype=np.uint16),
    )
    back = from_open3d(to_open3d(chunk))
    for name in ("points", "times", "ranges", "intensity", "sigma", "ring"):
        assert np.array_equal(getattr(back, name), getattr(chunk, name)), name
        assert getattr(back, name).dtype == getattr(chunk, name).dtype
    points = oriented_points(inside, spacing=0.2)
    normals = to_open3d(points).point["normals"].numpy()
    assert np.abs(normals - points.normals).max() < 1e-6


def test_a_trajectory_becomes_lines_and_comes_back(o3d):
    rng = np.random.default_rng(143)
    quats = rng.normal(size=(6, 4))
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    way = Trajectory(np.arange(6.0), rng.normal(size=(6, 3)) + THERE, quats)
    lines = to_open3d(way)
    assert lines.line.indices.numpy().tolist() == [[i, i + 1] for i in range(5)]
    back = from_open3d(lines)
    assert np.array_equal(back.positions, way.positions)
    assert np.array_equal(back.times, way.times)
    assert np.allclose(back.quats_xyzw, way.quats_xyzw, atol=1e-15)
    bare = o3d.t.geometry.LineSet(lines.point.positions, lines.line.indices)
    with pytest.raises(UsageError, match="is no trajectory"):
        from_open3d(bare)


def test_a_legacy_cloud_is_points_and_a_box_is_refused(o3d):
    legacy = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(ball(10) + THERE))
    assert np.array_equal(from_open3d(legacy).points, ball(10) + THERE)
    with pytest.raises(UsageError, match="AxisAlignedBoundingBox is neither"):
        from_open3d(o3d.geometry.AxisAlignedBoundingBox())


def test_times_of_a_run_begin_at_its_start(o3d, tmp_path):  # noqa: ARG001
    run = write_run(tmp_path / "run", ball(100), map_format="ply")
    times = to_open3d(run).point["time"].numpy().ravel()
    assert START_NS > 10**18
    assert times[[0, -1]] == pytest.approx([0.0, 10.0])


def test_chunks_with_normals_and_attributes_become_one_cloud(o3d, inside):
    """As an export yields them, with what a map carries of the recording."""
    chunks = list(export_points(inside))
    cloud = to_open3d(iter(chunks))
    assert len(cloud.point.positions) == sum(map(len, chunks)) == 40_000
    attributes = np.zeros(5, [("near_ir", "<u2"), ("signal", "<f4")])
    attributes["near_ir"], attributes["signal"] = np.arange(5), np.arange(5) / 7
    one = replace(
        chunks[0].where(slice(5)),
        attributes=attributes,
        normals=np.eye(3, dtype=np.float32)[[0, 1, 2, 0, 1]],
    )
    cloud = to_open3d([one, one])
    assert np.array_equal(cloud.point["near_ir"].numpy().ravel(), [*range(5)] * 2)
    assert cloud.point["near_ir"].dtype == o3d.core.uint16
    back = from_open3d(cloud)
    assert np.array_equal(back.normals, np.vstack([one.normals] * 2))
    assert np.array_equal(back.attributes["signal"], np.tile(attributes["signal"], 2))


def test_a_window_becomes_its_surfaces(o3d):  # noqa: ARG001
    """Of a lidar that moves through a box of 4 x 5 x 3 m."""
    rng = np.random.default_rng(905)
    times = np.sort(rng.uniform(0.0, 2.0, 60_000))
    way = Trajectory(
        np.arange(0, 2.02, 0.02),
        np.linspace([0, 0, 0], [0.4, 0.2, 0], 101),
        np.tile([0, 0, 0, 1.0], (101, 1)),
    )
    sensors = np.stack(
        [np.interp(times, way.times, way.positions[:, axis]) for axis in range(3)], axis=1
    )
    rays = rng.normal(size=(len(times), 3))
    sizes = np.array([2.0, 2.5, 1.5])
    reach = ((np.sign(rays) * sizes - sensors) / rays).min(axis=1)
    found = register_window(rays * reach[:, None], times, way)
    cloud = to_open3d(found)
    points, normals = (cloud.point[name].numpy() for name in ("positions", "normals"))
    assert len(points) == found.n_surfels > 100
    on = np.abs(np.abs(points) - sizes).min(axis=1)
    assert np.median(on) < 0.02  # one standard deviation of the lidar that nobody describes
    axis = np.abs(normals).argmax(axis=1)
    rows = np.arange(len(points))
    flat = np.abs(normals[rows, axis]) > 0.999
    assert flat.mean() > 0.7  # the largest of them round the edges
    # of a box seen from inside they point to its middle
    assert (normals[rows, axis][flat] * points[rows, axis][flat] < 0).all()
    assert 0.0 < cloud.point["time"].numpy().min() < cloud.point["time"].numpy().max() < 2.0


@pytest.mark.slow
def test_icp_of_open3d_agrees_with_a_registration_without_a_guess(o3d, shared_data):
    """Two real scans of an office; ICP starts from our pose, and stays within its own scatter."""
    scans = [shared_data / "room_scans" / f"room_scan{n}.pcd" for n in (1, 2)]
    (found,) = match_places(*map(places_of_cloud, scans))
    T_a_b = found.alignment.T_a_b
    clouds = [o3d.io.read_point_cloud(str(path)) for path in scans]
    for cloud in clouds:
        cloud.estimate_normals(o3d.geometry.KDTreeSearchParamHybrid(0.2, 30))
    method = o3d.pipelines.registration.TransformationEstimationPointToPlane()
    refined = o3d.pipelines.registration.registration_icp(clouds[1], clouds[0], 0.1, T_a_b, method)
    change = np.linalg.inv(T_a_b) @ refined.transformation
    angle = np.degrees(np.arccos((np.trace(change[:3, :3]) - 1) / 2))
    assert refined.fitness > 0.5
    assert np.linalg.norm(change[:3, 3]) < 0.02
    # by as much as the test of the places allows from the pose that others have found
    assert angle < 0.5


def test_a_trajectory_of_a_run_is_in_the_frame_of_its_map(o3d, inside):  # noqa: ARG001
    way, _ = read_tum(inside / "trajectory.txt")
    lines = to_open3d(way)
    cloud = to_open3d(inside)
    assert (
        np.linalg.norm(
            lines.point.positions.numpy() - cloud.point.positions.numpy().mean(axis=0), axis=1
        ).max()
        < 0.5
    )
