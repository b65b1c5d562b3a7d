# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a live user may rely upon: errors, threads, limits."""

from __future__ import annotations

import gc
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import bentwing
from bentwing.base.errors import DivergedError, NotEnoughDataError, PayloadError, UsageError
from bentwing.flight.control.spin_target import structure_support
from bentwing.odometry import Continuous
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.recording import ImuBatch, LidarBatch

UP = (0.0, 0.0, 9.81)
STILL = (0.0, 0.0, 0.0)


def until(pieces, end):
    return [p for p in pieces if p.times[-1] < end]


@pytest.fixture
def held(monkeypatch):
    """Registrations wait for `go` from the moment `hold` is set; `waiting` tells that one does."""

    class Gate:
        hold, waiting, go = threading.Event(), threading.Event(), threading.Event()

    step = OdometryPass.step

    def gated(self, buffer, end):
        if Gate.hold.is_set():
            Gate.waiting.set()
            assert Gate.go.wait(60.0)
        step(self, buffer, end)

    monkeypatch.setattr(OdometryPass, "step", gated)
    yield Gate
    Gate.go.set()


def test_reading_and_feeding_do_not_wait_for_a_registration(new, flight, held):
    odometry = new()
    for piece in until(flight.pieces, 8.0):
        odometry.feed(piece)
    assert odometry.wait(60.0)
    held.hold.set()
    fed = [p for p in flight.pieces if 8.0 <= p.times[-1] < 11.0]
    for piece in fed:
        odometry.feed(piece)
    assert held.waiting.wait(10.0)
    pose = odometry.pose()
    assert pose.time == max(p.times[-1] for p in fed if isinstance(p, ImuBatch))
    assert pose.predicted > 3.0
    odometry.feed(flight.pieces[len(until(flight.pieces, 11.0))])
    assert odometry.status == "coasting"
    assert odometry.health.time < 8.0
    assert len(odometry.map_points())
    assert len(odometry.trajectory.times)
    assert not odometry.wait(0.01)
    held.go.set()
    assert odometry.wait(60.0)
    assert odometry.pose().predicted < 1.5


def test_a_pose_takes_less_than_a_millisecond_while_windows_are_registered(new, flight):
    odometry = new()
    for piece in until(flight.pieces, 8.0):
        odometry.feed(piece)
    odometry.wait()
    for piece in flight.pieces[len(until(flight.pieces, 8.0)) :]:
        odometry.feed(piece)
    times = []
    while not odometry.wait(0.001):
        before = time.perf_counter()
        odometry.pose()
        times.append(time.perf_counter() - before)
    assert len(times) > 20
    assert np.median(times) < 1e-3


def feed_in_step(odometry, pieces, kind, other, reached):
    """Feed one sensor's pieces, not further ahead of the other's than drivers would be."""
    for piece in pieces:
        if isinstance(piece, kind):
            while reached[other] < piece.times[0] - 0.5:
                time.sleep(1e-4)
            odometry.feed(piece)
            reached[kind] = piece.times[-1]
    reached[kind] = np.inf


def read_until(done, odometry):
    newest = window = 0.0
    while not done.is_set():
        if odometry.status == "waiting":
            time.sleep(1e-3)
            continue
        pose = odometry.pose()
        assert pose.time >= newest
        assert np.isfinite(pose.position).all()
        newest = pose.time
        odometry.new_points()
        assert window <= odometry.health.time <= odometry.pose().time
        window = odometry.health.time
        assert odometry.counts["live.points_dropped"] == 0


def test_sensors_may_feed_from_threads_of_their_own_while_others_read(
    new, flight, estimate, all_bytes
):
    odometry, fed = new(), threading.Event()
    reached = {ImuBatch: 0.0, LidarBatch: 0.0}
    with ThreadPoolExecutor(4) as pool:
        readers = [pool.submit(read_until, fed, odometry) for _ in range(2)]
        feeders = [
            pool.submit(feed_in_step, odometry, flight.pieces, *kinds, reached)
            for kinds in ((ImuBatch, LidarBatch), (LidarBatch, ImuBatch))
        ]
        try:
            for feeder in feeders:
                feeder.result(60.0)
            final = odometry.finish()
        finally:
            reached.update({ImuBatch: np.inf, LidarBatch: np.inf})
            fed.set()
        for reader in readers:
            reader.result(60.0)
    assert all_bytes(final) == all_bytes(estimate)


def wrong_batches():
    stamps = np.array([8.0, 8.005])
    rows = np.zeros((2, 3))
    nan = np.array([[0.0, 0.0, 1.0], [0.0, np.nan, 1.0]])
    return {
        "nan_gyro": ("add_imu", (stamps, nan, rows), r"IMU batch at 8.0+ s: gyro: row 1 is not"),
        "nan_accel": ("add_imu", (8.0, STILL, (0, 0, np.inf)), r"IMU batch .* accel: row 0"),
        "nan_point": ("add_points", (nan, stamps), r"point batch .* points: row 1 .*leave out"),
        "nan_time": ("add_points", (rows, [8.0, np.nan]), r"point batch .* times: row 1"),
        "back_in_batch": ("add_imu", (stamps[::-1], rows, rows), r"IMU .* row 1 goes back by 0.005"),
        "back_to_before": ("add_points", (rows, [1.0, 2.0]), r"point .* before 7\..*in the order"),
        "shape": ("add_points", (np.zeros((2, 4)), stamps), r"expected shape \(2, 3\), got \(2, 4\)"),
        "angles": ("add_encoder", (stamps, [1.0]), r"encoder .* angles: expected shape \(2,\)"),
        "nan_angle": ("add_encoder", (stamps, [1.0, np.nan]), r"encoder .* angles: row 1"),
        "epoch": ("add_imu", (1.7e9, STILL, UP), r"seconds since a start of your choice"),
        "times_2d": ("add_imu", (np.zeros((2, 2)), rows, rows), r"times: expected shape \(N,\)"),
    }  # fmt: skip


def test_a_wrong_batch_is_refused_by_name_and_changes_nothing(new, flight, estimate, all_bytes):
    odometry = new()
    middle = len(until(flight.pieces, 8.0))
    for piece in flight.pieces[:middle]:
        odometry.feed(piece)
    for method, arguments, message in wrong_batches().values():
        with pytest.raises(ValueError, match=message):
            getattr(odometry, method)(*arguments)
    for piece in flight.pieces[middle:]:
        odometry.feed(piece)
    assert all_bytes(odometry.finish()) == all_bytes(estimate)


def test_what_is_fed_may_be_overwritten_afterwards(new, flight, estimate, all_bytes):
    """Drivers fill the same memory again."""
    odometry = new()
    for batch in flight.pieces:
        copy = replace(
            batch,
            **{
                name: getattr(batch, name).copy()
                for name in ("times", "points", "gyro", "accel")
                if hasattr(batch, name)
            },
        )
        odometry.feed(copy)
        copy.times[:] = np.nan
    assert all_bytes(odometry.finish()) == all_bytes(estimate)


def test_times_without_a_pose_are_refused(flown):
    newest = flown.odometry.pose().time
    assert flown.odometry.pose(at=newest + 0.05).time == newest + 0.05
    with pytest.raises(ValueError, match=r"at: .* beyond the newest data"):
        flown.odometry.pose(at=newest + 0.2)
    with pytest.raises(ValueError, match=r"at: -1\.000 s is before the first pose at 0\.0"):
        flown.odometry.pose(at=-1.0)
    with pytest.raises(ValueError, match="at: nan"):
        flown.odometry.pose(at=np.nan)


def test_without_a_start_there_is_nothing_to_read_yet(new):
    odometry = new()
    odometry.add_imu(0.0, STILL, UP)
    for read in (odometry.pose, odometry.estimate, lambda: odometry.trajectory):
        with pytest.raises(NotEnoughDataError, match="no pose yet"):
            read()
    assert odometry.health is None
    assert odometry.map_points().shape == (0, 3)
    assert odometry.new_points().points.shape == (0, 3)
    with pytest.raises(NotEnoughDataError, match="lidar"):
        odometry.finish()


def test_points_that_come_too_fast_are_left_out_and_counted_until_there_is_time(new, flight, held):
    odometry = new(max_lag=3.0)
    first, second = len(until(flight.pieces, 8.0)), len(until(flight.pieces, 11.0))
    for piece in flight.pieces[:first]:
        odometry.feed(piece)
        odometry.wait()
    assert odometry.counts["live.points_dropped"] == 0
    held.hold.set()
    for piece in flight.pieces[first:second]:
        odometry.feed(piece)
    assert odometry.counts["live.points_dropped"] > 0
    held.hold.clear()
    held.go.set()
    for piece in flight.pieces[second:]:
        odometry.feed(piece)
        odometry.wait()
    assert odometry.status in {"tracking", "degenerate"}
    assert odometry.pose().predicted < 1.5


def test_without_points_the_status_says_that_the_imu_is_alone(new, flight):
    odometry = new()
    for piece in flight.pieces:
        if piece.times[-1] < 8.5 or isinstance(piece, ImuBatch):
            odometry.feed(piece)
            odometry.wait()
        if 8.0 < piece.times[-1] < 9.0:
            assert odometry.status in {"tracking", "degenerate"}
    assert odometry.status == "coasting"
    assert odometry.pose().predicted > 3.0


def test_a_failure_is_told_to_who_feeds_and_to_who_reads(new, flight, monkeypatch, caplog):
    odometry = new()
    for piece in until(flight.pieces, 8.0):
        odometry.feed(piece)
    odometry.wait()

    def diverge(*_, **__):
        msg = "moved by 1000 m"
        raise DivergedError(msg)

    monkeypatch.setattr(Continuous, "advance", diverge)
    odometry.feed(flight.pieces[len(until(flight.pieces, 8.0))])
    with pytest.raises(DivergedError, match="1000 m"):
        odometry.wait()
    assert odometry.status == "failed"
    for call in (odometry.pose, odometry.finish, lambda: odometry.feed(flight.pieces[-1])):
        with pytest.raises(DivergedError, match="1000 m"):
            call()
    assert "live odometry has failed" in caplog.messages
    assert len(odometry.trajectory.times)  # what was estimated until then


def in_g(gyro, accel):
    return gyro, accel / 9.80665


def in_degrees(gyro, accel):
    return np.degrees(gyro), accel


def swapped(gyro, accel):
    return gyro[:, [1, 0, 2]], accel[:, [1, 0, 2]]


@pytest.mark.parametrize("wrong", [in_g, in_degrees, swapped])
def test_an_imu_that_is_wrong_fails_within_ten_seconds_of_motion(
    new, simulated, read_flight, wrong
):
    odometry, flight = new(), read_flight(simulated("office", 22.0), length=15.0)

    def fly():
        for piece in flight.pieces:
            if isinstance(piece, ImuBatch):
                gyro, accel = wrong(piece.gyro, piece.accel)
                piece = ImuBatch(piece.times, gyro, accel)
            odometry.feed(piece)
            odometry.wait()

    with pytest.raises(DivergedError, match="the estimate is wrong: "):
        fly()
    assert odometry.status == "failed"
    with pytest.raises(DivergedError, match="the estimate is wrong: "):
        odometry.pose()


def test_a_closed_odometry_can_be_read_but_not_fed(new, flight):
    with new() as odometry:
        for piece in until(flight.pieces, 8.0):
            odometry.feed(piece)
        odometry.wait()
    assert np.isfinite(odometry.pose().position).all()
    with pytest.raises(UsageError, match="closed"):
        odometry.feed(flight.pieces[-1])
    with pytest.raises(UsageError, match="closed"):
        odometry.finish()


def test_an_odometry_that_is_forgotten_ends_its_thread(flight):
    odometry = bentwing.Odometry(flight.payload)
    thread = odometry._worker._thread
    assert thread.is_alive()
    del odometry
    gc.collect()
    thread.join(10.0)
    assert not thread.is_alive()


def test_a_lidar_alone_is_predicted_at_constant_velocity(new, flight):
    payload = flight.payload.model_copy(update={"imu": None, "T_imu_lidar": None})
    odometry = new(payload)
    with pytest.raises(ValueError, match="without inertial samples"):
        odometry.add_imu(0.0, STILL, UP)
    for piece in until(flight.pieces, 7.0):
        if isinstance(piece, LidarBatch):
            odometry.feed(piece)
    odometry.wait()
    pose = odometry.pose()
    assert pose.time == pytest.approx(7.0, abs=0.06)
    assert np.isfinite(pose.position).all()


def test_inertial_samples_that_come_after_the_start_are_refused(new, flight):
    odometry = new()
    for piece in until(flight.pieces, 7.0):
        if isinstance(piece, LidarBatch):
            odometry.feed(piece)
    odometry.wait()
    with pytest.raises(ValueError, match="first six seconds"):
        odometry.add_imu(7.0, STILL, UP)


def test_a_long_rest_is_waited_out_in_bounded_memory(new):
    odometry = new()
    rng = np.random.default_rng(1)
    wall = rng.uniform([1.0, -1.0, 0.0], [8.0, 1.0, 0.0], (20, 3))
    for second in range(150):
        stamps = second + np.arange(0.0, 1.0, 0.01)
        odometry.add_imu(stamps, rng.normal(0, 1e-3, (100, 3)), UP + rng.normal(0, 1e-2, (100, 3)))
        odometry.add_points(wall, second + np.linspace(0.0, 0.9, len(wall)))
        odometry.wait()
    assert odometry.status == "waiting"
    first, last = odometry._engine.buffer.lidar_span
    assert last - first < 62.0
    assert len(odometry._state._imu) < 62.0 * 100


@pytest.mark.parametrize(
    "options",
    [
        {"map_spacing": 0.0},
        {"map_spacing": np.nan},
        {"max_map_points": 0},
        {"max_lag": 0},
        {"usual_rate": 0.0},
    ],
)
def test_options_out_of_range_are_refused(flight, options):
    with pytest.raises(UsageError, match=next(iter(options))):
        bentwing.Odometry(flight.payload, **options)


def test_a_payload_may_be_given_as_a_file(simulated, tmp_path):
    folder = simulated("office", 22.0)
    with bentwing.Odometry(folder / "payload.yaml") as odometry:
        assert odometry.status == "waiting"
    with pytest.raises(PayloadError, match="no such file"):
        bentwing.Odometry(tmp_path / "none.yaml")


def spin_up_and_stall(feed):
    """Feed three seconds of turning and one of standing still, as they come."""
    for k in range(400):
        feed(0.01 * k, 6.0 if k < 300 else 0.1)


def test_a_stall_is_told_while_it_lasts(new):
    odometry = new(usual_rate=6.0)
    assert odometry.stall is None
    spin_up_and_stall(lambda time, rate: odometry.add_imu(time, (0.0, 0.0, rate), UP))
    assert odometry.stall.start == pytest.approx(3.0, abs=0.15)
    assert "stalled" in odometry.stall.warning
    for k in range(50):
        odometry.add_imu(4.0 + 0.01 * k, (0.0, 0.0, 6.0), UP)
    assert odometry.stall is None
    with pytest.raises(UsageError, match="usual_rate"):
        new().stall  # noqa: B018 - reading it is the test


def test_an_encoder_knows_better_than_the_imu_of_a_body_that_turns(new, turned_payload):
    odometry, angle = new(turned_payload, usual_rate=6.0), 0.0

    def feed(time, rate):
        nonlocal angle
        angle += 0.01 * rate
        odometry.add_encoder(time, angle)
        odometry.add_imu(time, (0.0, 0.0, 6.0), UP)

    spin_up_and_stall(feed)
    assert odometry.stall.start == pytest.approx(3.0, abs=0.15)


def test_the_last_window_tells_which_way_surfaces_face(flown):
    normals = flown.odometry.surfel_normals()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1.0, abs=1e-6)
    # an office: walls, floor and ceiling face along three axes
    upright = np.abs(normals[:, 2]) > 0.97
    assert 0.1 < upright.mean() < 0.9
    level = normals[~upright]
    assert np.median(np.abs(level[:, 2])) < 0.05
    assert structure_support(normals) > 0.1


def test_without_a_window_there_are_no_normals(new):
    assert new().surfel_normals().shape == (0, 3)
