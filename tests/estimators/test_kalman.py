# SPDX-License-Identifier: MIT OR Apache-2.0
"""The Kalman filter: what it makes of flights, what it says of itself, and what it refuses.

Bounds: a sweep has some thousand features of 7 mm each, and the mounts are wrong by 0.3°, which the
filter has to find out; poses are right to about a centimetre after twenty seconds.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import replace

import numpy as np
import pytest
import yaml

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.errors import (
    EstimationError,
    NotEnoughDataError,
    PayloadError,
    RecordingError,
)
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.trajectory import absolute_error
from bentwing.odometry.kalman import KalmanSettings
from bentwing.odometry.kalman.beginning import Rest
from bentwing.odometry.kalman.core import (
    BASE_ROTATION,
    ENCODER_DELAY,
    first_state,
    unlearned_delay,
)
from bentwing.odometry.start import find_start
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.described import described_calibration
from bentwing.recording.preprocess import preprocess
from bentwing.simulate import Scenario, simulate

LENGTH = 22.0
IMU_AT_REST = ImuBatch(
    np.arange(300) * 0.005, np.zeros((300, 3)), np.tile([0.0, 0.0, 9.80665], (300, 1))
)


def fed(folder, *, until=LENGTH, change=lambda b: b, settings=None):
    """An engine that was fed a flight's first seconds, and the truth."""
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        engine = odometry.create("kalman", payload, settings, 1)
        for batch in preprocess(recording.batches(0.0, until), payload, Counter()):
            changed = change(batch)
            if changed is not None:
                engine.feed(changed)
    return engine, truth


@pytest.fixture(scope="session")
def turning(made_once):
    """A flight through an office with a lidar that turns once a second."""
    scenario = Scenario(scene="office", head="vlp16-motor", motor_rate=6.2832, duration=LENGTH)
    return made_once("kalman-turning", lambda folder: simulate(scenario, folder))


@pytest.fixture(scope="module")
def turned(turning):
    engine, truth = fed(turning)
    return engine, engine.result(), truth


def test_a_turning_lidar_is_followed_to_a_centimetre(turned):
    _, estimate, truth = turned
    error = absolute_error(estimate.trajectory, truth)
    assert error.position.rmse < 0.012
    assert error.position.maximum < 0.04
    assert not estimate.warnings


def test_at_rest_the_position_stays_before_the_motor_has_turned(turned):
    """A band of 30° hardly holds it; the inertial samples alone lose centimetres within a second."""
    _, estimate, _ = turned
    times = estimate.trajectory.times
    rest = estimate.trajectory.positions[times < times[0] + 3.0]
    assert np.ptp(rest, axis=0).max() < 0.008


def test_a_rest_is_over_as_soon_as_the_inertial_samples_change():
    rest = Rest(np.array([0.01, 0.0, -0.01]), np.array([0.1, 0.0, 9.8]))
    rng = np.random.default_rng(0)
    times = np.arange(20) * 0.005
    gyro = rng.normal(rest.rate, 0.005, (20, 3))
    accel = rng.normal(rest.force, 0.1, (20, 3))
    assert rest.lasts(ImuBatch(times, gyro, accel))
    assert not rest.lasts(ImuBatch(times, gyro + np.array([0.0, 0.0, 0.03]), accel))
    assert not rest.lasts(ImuBatch(times, gyro, accel + np.array([0.0, 0.0, 0.4])))
    assert not rest.lasts(ImuBatch(times[:0], gyro[:0], accel[:0]))


def test_a_delay_that_is_not_learned_turns_the_motor_the_other_way(turned):
    """Together with the turn of the mount it leaves the lidar where it is, at the rate of then."""
    engine, *_ = turned
    described = described_calibration(engine._payload)
    state = first_state(find_start(IMU_AT_REST, engine._imu, 0.0), described)
    covariance = unlearned_delay(6.0, described.mount, state)
    std = np.sqrt(np.diag(covariance))
    assert std[ENCODER_DELAY] == pytest.approx([3e-3])
    assert std[BASE_ROTATION] == pytest.approx([0.0, 0.0, 6.0 * 3e-3])
    assert covariance[19, 30] == pytest.approx(6.0 * 9e-6)
    assert np.linalg.matrix_rank(covariance) == 1


def test_the_mounts_are_found_within_what_is_stated(turned, turning):
    """Of the lidar behind the motor the tilts; the turn about the axis is the motor's."""
    _, estimate, _ = turned
    true = yaml.safe_load((turning / "truth_calibration.yaml").read_text())
    found = estimate.calibration
    described = np.array(true["encoder"]["T_motor_lidar"]["quaternion"])
    turn = geometry.multiply(found.mount.T_motor_lidar.quaternion, geometry.inverse(described))
    assert np.abs(geometry.log(turn)[:2]).max() < 1.5e-3  # rad; before: 4
    assert found.latency == pytest.approx(true["latency"], abs=1e-3)
    assert max(found.std["motor_tilt"]) < 1e-3
    assert found.std["latency"][0] < 1e-3


def test_without_the_encoder_the_filter_is_lost(turning, turned):
    """R-FAST-LIO of the paper, which failed there, too."""
    engine, truth = fed(turning, settings=KalmanSettings(rotation="ignored"))
    try:
        error = absolute_error(engine.result().trajectory, truth).position.rmse
    except EstimationError:
        return
    assert error > 20 * absolute_error(turned[1].trajectory, truth).position.rmse


def test_the_odometry_keeps_its_rate_and_is_smooth(turned):
    engine, estimate, truth = turned
    raw, smoothed = engine.odometry()
    assert np.diff(raw.times) == pytest.approx(0.02)
    assert raw.times.tolist() == smoothed.times.tolist()
    error = absolute_error(raw, truth).position
    assert error.rmse < 0.02
    assert error.maximum < 0.08
    # Between updates the inertial samples carry the pose; the correction is a step.
    jerk = [np.abs(np.diff(t.positions, 2, axis=0)).sum() for t in (raw, smoothed)]
    assert jerk[1] < 0.8 * jerk[0]
    assert len(raw.times) == pytest.approx(50 * np.ptp(estimate.trajectory.times), abs=2)


def test_stated_covariances_become_small_and_have_no_negative_direction(turned):
    engine, *_ = turned
    times, covariances = engine.pose_covariances()
    assert len(times) > 200
    values = np.linalg.eigvalsh(covariances[1:])
    assert values.min() >= -1e-12
    position = np.sqrt(np.trace(covariances[:, 3:, 3:], axis1=1, axis2=2))
    # At first the place of the IMU beside the lidar is known to 5 mm an axis, and turned by 9 mrad.
    assert 0.002 < position[-1] < 0.03


def test_without_rings_points_are_features(turning):
    def ringless(batch):
        return replace(batch, ring=None) if isinstance(batch, LidarBatch) else batch

    engine, truth = fed(turning, until=12.0, change=ringless, settings=KalmanSettings(rehearsal=0))
    assert absolute_error(engine.result().trajectory, truth).position.rmse < 0.03


def test_an_inertial_silence_begins_anew_in_the_same_direction(turning):
    def silent(batch):
        if isinstance(batch, ImuBatch) and 14.0 < batch.times[0] < 14.6:
            return None
        return batch

    engine, _ = fed(turning, change=silent)
    estimate = engine.result()
    assert len(estimate.segments) == 2
    assert any("no inertial data from 14" in w for w in estimate.warnings)
    assert np.diff(estimate.trajectory.times) == pytest.approx(0.01)


def test_without_inertial_samples_it_is_refused_in_a_sentence(turning):
    with pytest.raises(RecordingError, match=r"there is none in the first \d.*--estimator ndt"):
        fed(turning, change=lambda b: None if isinstance(b, ImuBatch) else b)


def test_a_recording_without_imu_is_refused(shared_data):
    engine = odometry.create("kalman", Payload.default())
    with Recording(shared_data / "garage_hdl32.bag", Payload.default()) as recording:
        batches = list(recording.batches(0.0, 4.0))
    with pytest.raises(RecordingError, match="predicts by an IMU"):
        deque(map(engine.feed, batches), maxlen=0)


def test_a_2d_lidar_is_refused_by_its_kind():
    payload = Payload.model_validate({"lidar": {"kind": "hokuyo-utm30lx"}})
    with pytest.raises(PayloadError, match=r"single planes.*--estimator continuous"):
        odometry.create("kalman", payload)


def test_a_2d_lidar_of_unknown_kind_is_refused_by_its_points():
    angles = np.linspace(0.0, 6.0, 8000)
    points = np.stack([5 * np.cos(angles), 4 * np.sin(angles), 0 * angles], axis=1)
    engine = odometry.create("kalman", Payload.default())
    times = np.arange(400) / 200.0
    engine.feed(ImuBatch(times, np.zeros((400, 3)), np.tile([0.0, 0.0, 9.8], (400, 1))))
    with pytest.raises(NotEnoughDataError, match="one plane"):
        engine.feed(LidarBatch(points, np.linspace(0.0, 1.9, 8000)))
