# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs as MCAP files, read back by the format's own library with the definitions in the file."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from bentwing import ExportOptions, export
from bentwing.base import geometry
from bentwing.base.covariances import PoseCovariances
from bentwing.base.errors import UsageError
from bentwing.map import Crop
from bentwing.map.chunk import MapChunk
from bentwing.run.export.finished import Finished
from bentwing.run.export.mcap_file import write_mcap
from bentwing.run.run import COVARIANCES
from support.finished_runs import START_NS, finished_run, flight, on_earth

N = 20_000


@pytest.fixture(scope="module")
def points():
    return np.random.default_rng(5).uniform([-20, -15, -1], [20, 15, 6], (N, 3))


def covariances():
    rng = np.random.default_rng(6)
    roots = rng.normal(0.0, 0.01, (5, 6, 6))
    return PoseCovariances(np.linspace(0, 20, 5), roots @ roots.transpose(0, 2, 1))


@pytest.fixture(scope="module")
def run(points, tmp_path_factory):
    folder = finished_run(tmp_path_factory.mktemp("export") / "run", points, placed=on_earth())
    covariances().write(folder / COVARIANCES, START_NS)
    return folder


def read(path, *, in_order=True):
    """Return messages by topic with their times in the log, and the names of the types."""
    found, kinds, logged = {}, {}, []
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            assert (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            kinds[channel.topic] = schema.name
            found.setdefault(channel.topic, []).append((message.log_time, decoded))
            logged.append(message.log_time)
    assert not in_order or logged == sorted(logged)
    return found, kinds


@pytest.fixture(scope="module")
def exported(run, tmp_path_factory):
    path = tmp_path_factory.mktemp("mcap") / "run.mcap"
    done = export(run, path, ExportOptions(spacing=0.0))
    return done, *read(path)


def stamp_ns(message):
    return message.header.stamp.sec * 10**9 + message.header.stamp.nanosec


def xyz(vector):
    return np.array([vector.x, vector.y, vector.z])


def cloud_points(message):
    names = [field.name for field in message.fields]
    assert [field.datatype for field in message.fields] == [7] * len(names)
    rows = np.frombuffer(message.data, "<f4").reshape(message.width, len(names))
    assert message.row_step == message.point_step * message.width == len(message.data)
    return names, rows


def test_topics_have_the_types_that_viewers_of_ros_2_know(exported):
    _, found, kinds = exported
    assert kinds == {
        "/path": "nav_msgs/msg/Path",
        "/tf_static": "tf2_msgs/msg/TFMessage",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/odometry": "nav_msgs/msg/Odometry",
        "/map_points": "sensor_msgs/msg/PointCloud2",
    }
    assert len(found["/tf"]) == len(found["/odometry"]) == 1001


def test_poses_are_those_of_the_trajectory_at_their_stamps(exported):
    _, found, _ = exported
    poses = flight()
    for log_ns, message in found["/odometry"][::53]:
        time = (stamp_ns(message) - START_NS) / 1e9
        place, quat = poses.interpolate(np.array([time]))
        assert log_ns == stamp_ns(message)
        np.testing.assert_allclose(xyz(message.pose.pose.position), place[0], atol=2e-6)
        turned = message.pose.pose.orientation
        found_quat = np.array([turned.x, turned.y, turned.z, turned.w])
        assert abs(found_quat @ quat[0]) == pytest.approx(1.0, abs=1e-9)
        assert (message.header.frame_id, message.child_frame_id) == ("map", "imu")


def test_transforms_agree_with_the_odometry(exported):
    _, found, _ = exported
    for (_, tf), (_, odometry) in zip(found["/tf"], found["/odometry"], strict=True):
        (link,) = tf.transforms
        assert (link.header.frame_id, link.child_frame_id) == ("map", "imu")
        there = xyz(link.transform.translation)
        np.testing.assert_array_equal(there, xyz(odometry.pose.pose.position))


def test_covariances_have_the_place_first(exported):
    _, found, _ = exported
    for _, message in found["/odometry"][::97]:
        time = (stamp_ns(message) - START_NS) / 1e9
        expected = covariances().at([time])[0]
        given = np.array(message.pose.covariance).reshape(6, 6)
        np.testing.assert_allclose(given[:3, :3], expected[3:, 3:], rtol=1e-4, atol=1e-9)
        np.testing.assert_allclose(given[3:, 3:], expected[:3, :3], rtol=1e-4, atol=1e-9)
        np.testing.assert_allclose(given[3:, :3], expected[:3, 3:], rtol=1e-4, atol=1e-9)


def test_velocities_are_in_the_frame_of_the_imu(exported):
    """A circle of 5 m in 20 s, the IMU's y along it, rising by 0.1 m/s."""
    _, found, _ = exported
    for _, message in found["/odometry"][1:-1:97]:
        speed = 5 * 2 * np.pi / 20
        np.testing.assert_allclose(xyz(message.twist.twist.linear), [0, speed, 0.1], atol=2e-3)
        np.testing.assert_allclose(xyz(message.twist.twist.angular), [0, 0, np.pi / 10], atol=2e-3)


def test_the_path_is_there_from_the_first_moment_on(exported):
    _, found, _ = exported
    ((log_ns, path),) = found["/path"]
    assert log_ns == START_NS
    times = [(stamp_ns(pose) - START_NS) / 1e9 for pose in path.poses]
    np.testing.assert_allclose(np.diff(times), 0.1, atol=0.02)
    assert times[-1] == pytest.approx(19.99)


def test_the_map_grows_by_clouds_of_a_second_in_the_frame_of_the_path(exported, points):
    done, found, _ = exported
    assert done.n_points == N
    assert "20,000 points" in done.sentence()
    clouds = found["/map_points"]
    assert len(clouds) == 20
    at = 0
    for log_ns, message in clouds:
        names, rows = cloud_points(message)
        assert names == ["x", "y", "z", "intensity"]
        times = np.linspace(0.0, 19.9, N)[at : at + len(rows)]
        np.testing.assert_allclose(rows[:, :3], points[at : at + len(rows)], atol=2e-3)
        assert times[-1] == pytest.approx((log_ns - START_NS) / 1e9, abs=1e-6)
        assert np.ptp(times) < 1.0
        at += len(rows)
    assert at == N


def test_crops_and_spacing_act_on_the_points(run, points, tmp_path):
    options = ExportOptions(crop=Crop(times=(5.0, 7.5)), spacing=1.0)
    done = export(run, tmp_path / "a.mcap", options)
    found, _ = read(tmp_path / "a.mcap")
    times = np.linspace(0.0, 19.9, N)
    kept = points[(times >= 5.0) & (times <= 7.5)]
    n = sum(message.width for _, message in found["/map_points"])
    assert n == done.n_points
    assert n == pytest.approx(len(np.unique(np.floor(kept), axis=0)), abs=5)
    assert len(found["/odometry"]) == 1001


def test_covariances_that_are_not_known_are_zeros(points, tmp_path):
    folder = finished_run(tmp_path / "run", points[:100])
    export(folder, tmp_path / "a.mcap")
    found, _ = read(tmp_path / "a.mcap")
    assert not any(found["/odometry"][0][1].pose.covariance)
    (link,) = found["/tf_static"][0][1].transforms
    turned = link.transform.rotation
    assert geometry.log(np.array([turned.x, turned.y, turned.z, turned.w])).tolist() == [0, 0, 0]
    assert (link.header.frame_id, link.child_frame_id) == ("imu", "lidar")


def test_runs_of_a_merged_map_have_frames_and_topics_of_their_own(run, points, tmp_path):
    alone = Finished.open(run)
    late_ns = START_NS + 3 * 10**9
    (one,) = alone.flights
    flights = (replace(one, name="first day"), replace(one, name="second", start_ns=late_ns))
    record = {**alone.run.record, "runs": [{"name": each.name} for each in flights]}
    merged = replace(alone, run=replace(alone.run, record=record, flights=flights), flights=flights)
    times = np.linspace(0.0, 19.9, N)
    ranges = np.ones(N, np.float32)
    chunks = [MapChunk(points, times, ranges), MapChunk(points, times + 3.0, ranges)]
    n = write_mcap(tmp_path / "a.mcap", merged, (chunk for chunk in chunks))
    found, _ = read(tmp_path / "a.mcap", in_order=False)
    assert n == 2 * N == sum(message.width for _, message in found["/map_points"])
    assert set(found) == {
        "/tf", "/map_points", "/first_day/path", "/first_day/odometry", "/second/path",
        "/second/odometry",
    }  # fmt: skip
    frames = {link.child_frame_id for _, tf in found["/tf"] for link in tf.transforms}
    assert frames == {"first_day_imu", "second_imu"}
    assert found["/second/odometry"][0][0] == late_ns
    assert cloud_points(found["/map_points"][0][1])[0] == ["x", "y", "z"]


@pytest.mark.parametrize("options", [{"options": ExportOptions(epsg=32632)}, {"tiles": 10}])
def test_messages_have_one_frame_and_one_file(run, tmp_path, options):
    with pytest.raises(UsageError, match="in the frame of the trajectory and in one file"):
        export(run, tmp_path / "a.mcap", **options)
    assert not list(tmp_path.iterdir())


def test_a_crop_that_leaves_nothing_leaves_no_file(run, tmp_path):
    with pytest.raises(UsageError, match=r"no point of the map is left|nothing of the map"):
        export(
            run,
            tmp_path / "a.mcap",
            ExportOptions(crop=Crop(box=(-1, -1, 5.9, -0.99, -0.99, 5.91))),
        )
    assert not list(tmp_path.iterdir())
