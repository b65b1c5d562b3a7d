# SPDX-License-Identifier: MIT OR Apache-2.0
"""The parts of the live room on data whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.trajectory import DT
from bentwing.flight.live.backlog import Backlog
from bentwing.flight.live.imu_tail import ImuTail
from bentwing.flight.live.live_map import LiveMap
from bentwing.flight.live.prediction import Prediction
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.continuous.slow_states import SlowStatePrior
from bentwing.recording import ImuBatch, Payload

RATE = np.array([0.1, 0.0, 6.0])  # rad/s, imu frame
GYRO_BIAS = np.array([0.01, -0.02, 0.03])
ACCEL_BIAS = np.array([0.1, 0.05, -0.07])
GRAVITY = np.array([0.0, 0.0, 9.81])
TURN = 1.3  # rad/s around a circle of two metres


def truth(times):
    """Positions, attitudes and accelerations of a spinning head on a circle."""
    times = np.atleast_1d(times)
    positions = np.stack(
        [2 * np.cos(TURN * times), 2 * np.sin(TURN * times), np.zeros(len(times))], axis=1
    )
    return positions, geometry.exp(RATE * times[:, None]), -(TURN**2) * positions


def imu_between(start, stop):
    times = np.arange(start, stop, 0.005)
    _, quats, accel = truth(times)
    force = geometry.rotate(geometry.inverse(quats), accel + GRAVITY)
    return ImuBatch(times, np.tile(RATE + GYRO_BIAS, (len(times), 1)), force + ACCEL_BIAS)


@pytest.fixture
def registered():
    """A pass whose last window ended at one second, in a map tilted by a degree."""
    times = DT * np.arange(101)
    positions, quats, _ = truth(times)
    tilt = geometry.exp(np.array([0.0175, 0.0, 0.0]))
    still = (np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    samples = _core.Samples(
        0.0,
        DT,
        geometry.rotate(tilt, positions),
        geometry.multiply(np.broadcast_to(tilt, quats.shape), quats),
    )
    slow = _core.Globals(
        still,
        latency=0.01,
        gyro_bias=GYRO_BIAS,
        accel_bias=ACCEL_BIAS,
        gravity=geometry.rotate(tilt, GRAVITY),
    )
    settings = ContinuousSettings()
    prior = SlowStatePrior(None, has_motor=False, moving=False, frozen=())
    core = CoreSettings.of(settings.registration, Payload.default(), DT)
    return OdometryPass(samples, slow, prior, settings, core, threads=1, resting=False)


def tail_of(*batches):
    tail = ImuTail()
    for batch in batches:
        tail.append(batch)
    return tail


@pytest.mark.parametrize("at", [1.0, 1.003, 1.2, 1.497, 1.55])
def test_a_noiseless_flight_is_predicted_in_the_levelled_map(registered, at):
    """The force between the samples is taken as linear, and beyond the last one as constant."""
    pose = Prediction(registered).pose(at, tail_of(imu_between(0.5, 1.5)))
    positions, quats, _ = truth(at)
    assert np.linalg.norm(pose.position - positions[0]) < 2e-3
    assert abs(pose.quat_xyzw @ quats[0]) > 1 - 1e-6
    speed = 2 * TURN * np.array([-np.sin(TURN * at), np.cos(TURN * at), 0.0])
    assert pose.velocity == pytest.approx(speed, abs=0.05)
    assert pose.predicted == pytest.approx(at - 0.99)


def test_the_prediction_does_not_depend_on_how_the_samples_came(registered):
    imu = imu_between(0.5, 1.5)
    whole = Prediction(registered).pose(1.5, tail_of(imu))
    tail, step_by_step = ImuTail(), Prediction(registered)
    for k in range(len(imu.times)):
        tail.append(ImuBatch(imu.times[k : k + 1], imu.gyro[k : k + 1], imu.accel[k : k + 1]))
        step_by_step.pose(max(1.0, imu.times[k]), tail)
    pose = step_by_step.pose(1.5, tail)
    assert pose.position == pytest.approx(whole.position, abs=1e-9)
    assert pose.quat_xyzw == pytest.approx(whole.quat_xyzw, abs=1e-9)


def test_without_inertial_samples_the_velocity_is_constant(registered):
    positions, _, _ = truth([0.99, 1.0])
    expected = positions[1] + (positions[1] - positions[0]) / DT * 0.2
    for tail in (ImuTail(), tail_of(imu_between(0.0, 0.8))):
        pose = Prediction(registered).pose(1.2, tail)
        assert pose.position == pytest.approx(expected, abs=1e-6)


def test_the_tail_of_samples_is_what_was_not_forgotten():
    tail = ImuTail()
    assert len(tail) == 0
    assert tail.end == -np.inf
    for k in range(5000):
        tail.append(ImuBatch(np.array([k * 0.01]), np.full((1, 3), k), np.full((1, 3), -k)))
        tail.forget(k * 0.01 - 1.0)
    assert 100 <= len(tail) <= 102
    assert len(tail._rows) < 2048
    held = tail.since(49.5)
    assert held.times == pytest.approx(np.arange(4950, 5000) * 0.01)
    assert np.array_equal(held.gyro[:, 0], np.arange(4950, 5000))
    assert np.array_equal(held.accel[:, 2], -np.arange(4950, 5000))


def test_a_map_never_holds_more_points_than_it_may():
    cloud = LiveMap(0.1, 1000, 1)
    rng = np.random.default_rng(2)
    replaced = []
    for _ in range(20):
        cloud._keep(rng.uniform(0.0, 5.0, (500, 3)))
        assert len(cloud.points()) <= 1000
        replaced.append(cloud.update().replaces)
    assert cloud.spacing in {0.2, 0.4, 0.8}
    assert replaced[0]
    assert 2 <= sum(replaced) <= 5


def test_updates_of_a_map_join_to_the_map():
    cloud = LiveMap(0.1, 10_000, 1)
    rng = np.random.default_rng(3)
    parts = []
    for _ in range(5):
        cloud._keep(rng.uniform(0.0, 2.0, (300, 3)))
        parts.append(cloud.update().points)
    assert np.array_equal(np.concatenate(parts), cloud.points())


def taken(cost):
    """Shares of the scans that are taken, and lags, when a window needs `cost` s with all its scans."""
    backlog, registered, busy_until, window = Backlog(10.0), 0.0, 0.0, []
    share, lags = [], []
    for now in np.arange(0.0, 200.0, 0.025):
        take = backlog.has_time(now, registered, 1.0)
        share.append(take)
        window += [now] * take
        if now >= busy_until and window and window[-1] >= registered + 1.0:
            registered += 1.0
            used = [t for t in window if t < registered]
            window = [t for t in window if t >= registered]
            busy_until = now + cost * (0.3 + 0.7 * len(used) / 40)
        lags.append(now - registered)
    return np.mean(share[4000:]), np.array(lags[4000:])


def test_all_scans_are_taken_while_there_is_time():
    share, lags = taken(cost=0.9)
    assert share == 1.0
    assert lags.max() < 3.0


def test_scans_are_thinned_evenly_where_windows_take_too_long():
    """A window of 1.5 s is down to 1 s with half of its scans: 0.3 + 0.7 · 0.52 of it.

    What is left out shows in the lag two windows later.
    """
    share, lags = taken(cost=1.5)
    assert share == pytest.approx(0.52, abs=0.05)
    assert lags.max() < 10.0 + 2.0


def test_a_window_that_always_takes_too_long_gets_some_scan():
    """What is too slow for any scan falls behind, but never stands still."""
    share, lags = taken(cost=4.0)
    assert share > 0.0
    assert lags[-1] < 110.0
