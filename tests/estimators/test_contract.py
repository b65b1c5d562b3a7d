# SPDX-License-Identifier: MIT OR Apache-2.0
"""What everything downstream relies on, whichever estimator ran."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.errors import EstimationError, NotEnoughDataError, PayloadError, UsageError
from bentwing.base.mount import Pose
from bentwing.base.window_record import WindowRecord
from bentwing.recording import Encoder, ImuBatch, LidarBatch, Transform


def all_bytes(estimate):
    """Everything of an estimate that is not a time of computation."""
    trajectory, calibration = estimate.trajectory, estimate.calibration
    return [
        trajectory.times.tobytes(),
        trajectory.positions.tobytes(),
        trajectory.quats_xyzw.tobytes(),
        calibration.latency,
        calibration.mount.T_imu_lidar.translation.tobytes(),
        calibration.mount.T_imu_lidar.quaternion.tobytes(),
        calibration.gyro_bias.tobytes(),
        calibration.accel_bias.tobytes(),
        json.dumps(calibration.std),
        json.dumps([window.to_json() for window in estimate.windows]),
        estimate.counts,
        estimate.warnings,
    ]


def rows(batch, part):
    if isinstance(batch, LidarBatch):
        return batch.where(part)
    return ImuBatch(batch.times[part], batch.gyro[part], batch.accel[part])


def cut(batches, n):
    """Each batch in parts of at most `n` rows."""
    return [
        rows(batch, slice(i, i + n)) for batch in batches for i in range(0, len(batch.times), n)
    ]


def of_kind(batches, kind):
    return [batch for batch in batches if isinstance(batch, kind)]


def poisoned(batches, kind, field, *, at, value=np.nan):
    """The batches with one value of one field replaced, in the first batch of a kind after `at` s."""
    result = list(batches)
    i = next(i for i, b in enumerate(batches) if isinstance(b, kind) and b.times[0] >= at)
    array = getattr(result[i], field).copy()
    array[0] = value
    result[i] = replace(result[i], **{field: array})
    return result


def test_an_unknown_estimator_is_a_wrong_use(head):
    with pytest.raises(UsageError, match="'slam' is not known; choose continuous"):
        odometry.create("slam", head.payload)


def test_the_trajectory_has_100_poses_a_second_over_the_recording(plain_run, head, name):
    trajectory = plain_run(name).trajectory
    assert np.diff(trajectory.times) == pytest.approx(0.01)
    lidar = of_kind(head.batches, LidarBatch)
    assert trajectory.times[0] <= lidar[0].times[0] + 0.05
    assert trajectory.times[-1] >= lidar[-1].times[-1] - 0.01
    assert np.isfinite(trajectory.positions).all()
    assert np.linalg.norm(trajectory.quats_xyzw, axis=1) == pytest.approx(1.0, abs=1e-9)


def test_the_map_begins_level_at_the_first_pose(plain_run, name):
    """The origin is the first pose of the IMU, z is up: at rest the IMU has no tilt but its mount's."""
    estimate = plain_run(name)
    assert estimate.trajectory.positions[0] == pytest.approx(np.zeros(3), abs=1e-6)
    assert estimate.calibration.gravity == pytest.approx([0.0, 0.0, 9.80665], abs=0.05)


def test_the_record_of_an_estimate_is_json_and_tells_every_window(plain_run, name):
    estimate = plain_run(name)
    assert len(estimate.windows) >= 5
    records = [window.to_json() for window in estimate.windows]
    json.dumps([records, estimate.counts, estimate.timings, estimate.warnings])
    assert [WindowRecord.from_json(record) for record in records] == estimate.windows
    ends = [w.time for w in estimate.windows]
    assert ends == sorted(ends)
    for key in ("n_surfels", "n_matches", "residual_rms", "degenerate", "converged"):
        assert all(key in record for record in records)
    assert all(isinstance(n, int) for n in estimate.counts.values())


def test_standard_deviations_are_positive_and_smaller_than_before(plain_run, case, name):
    std = plain_run(name).calibration.std
    assert case.estimated <= set(std) if case.estimated else not std
    assert all(0 < value < 1 for values in std.values() for value in values)


def test_the_result_is_the_same_when_asked_again(head, name):
    engine = odometry.create(name, head.payload, None, 1)
    for batch in head.batches:
        if batch.times[0] < 6.5:
            engine.feed(batch)
    assert all_bytes(engine.result()) == all_bytes(engine.result())


@pytest.mark.parametrize("threads", [2, 4])
def test_the_number_of_threads_changes_no_bit(plain_run, run, name, threads):
    assert all_bytes(run(name, threads=threads)) == all_bytes(plain_run(name))


@pytest.mark.parametrize("n", [37, 400])
def test_batches_may_be_cut_anywhere(plain_run, run, head, name, n):
    assert all_bytes(run(name, batches=cut(head.batches, n))) == all_bytes(plain_run(name))


def test_sensors_may_be_interleaved_otherwise(plain_run, run, head, name):
    """A recorder may deliver the lidar late, as long as each sensor's own time never decreases."""
    late = sorted(
        enumerate(head.batches),
        key=lambda item: (item[1].times[-1] + 0.2 * isinstance(item[1], LidarBatch), item[0]),
    )
    batches = [batch for _, batch in late]
    assert [id(b) for b in batches] != [id(b) for b in head.batches]
    assert all_bytes(run(name, batches=batches)) == all_bytes(plain_run(name))


def test_empty_batches_change_nothing(plain_run, run, head, name):
    batches = []
    for batch in head.batches:
        batches += [batch, rows(batch, slice(0, 0))]
    assert all_bytes(run(name, batches=batches)) == all_bytes(plain_run(name))


def test_steps_that_are_taken_later_give_the_same_result(plain_run, quick, head, name):
    engine = odometry.create(name, head.payload, quick[name], 1)
    for i, batch in enumerate(head.batches):
        engine.take(batch)
        if i % 7 == 0:
            engine.advance()
    assert all_bytes(engine.result()) == all_bytes(plain_run(name))


def test_a_snapshot_stays_as_it_is_while_the_estimator_goes_on_behind_a_break(quick, head, name):
    engine = odometry.create(name, head.payload, quick[name], 1)
    batches = [b for b in head.batches if b.times[-1] < 7.0 or b.times[0] > 9.0]
    for batch in batches:
        if batch.times[0] > 9.0:
            break
        engine.feed(batch)
    snapshot = engine.current
    known, end = all_bytes(snapshot.estimate()), snapshot.registered.end
    recent = snapshot.registered.recent().positions.tobytes()
    for batch in batches:
        if batch.times[0] > 9.0:
            engine.feed(batch)
    assert engine.result().trajectory.times[-1] > 10.5
    assert engine.current.registered.end > end == snapshot.registered.end
    assert all_bytes(snapshot.estimate()) == known
    assert snapshot.registered.recent().positions.tobytes() == recent


def test_the_recent_poses_are_the_end_of_the_trajectory(quick, head, name):
    engine = odometry.create(name, head.payload, quick[name], 1)
    for batch in head.batches:
        if batch.times[-1] < 8.0:
            engine.feed(batch)
    snapshot = engine.current
    recent, whole = snapshot.registered.recent(), snapshot.estimate().trajectory
    assert recent.times[-1] == pytest.approx(whole.times[-1], abs=0.011)
    inside = whole.covers(recent.times)
    positions, _ = whole.interpolate(recent.times[inside])
    assert recent.positions[inside] == pytest.approx(positions, abs=1e-3)


def test_two_estimators_at_once_do_not_disturb_each_other(plain_run, quick, head, name):
    engines = [odometry.create(name, head.payload, quick[name], 1) for _ in range(2)]
    for batch in head.batches:
        for engine in engines:
            engine.feed(batch)
    for engine in engines:
        assert all_bytes(engine.result()) == all_bytes(plain_run(name))


def test_without_data_there_is_no_result(head, name):
    with pytest.raises(NotEnoughDataError, match="lidar"):
        odometry.create(name, head.payload).result()


def test_inertial_data_alone_is_not_enough(run, head, name):
    with pytest.raises(NotEnoughDataError, match="lidar"):
        run(name, batches=of_kind(head.batches, ImuBatch))


def test_a_few_points_are_not_enough(run, head, name):
    few = [b for b in head.batches if b.times[0] < 0.05]
    with pytest.raises(EstimationError):
        run(name, batches=few)


def test_an_estimation_error_is_told_in_a_sentence_with_a_number(run, head, name):
    with pytest.raises(NotEnoughDataError, match=r"\d"):
        run(name, batches=of_kind(head.batches, ImuBatch))


@pytest.mark.parametrize(
    ("kind", "field"),
    [(LidarBatch, "points"), (ImuBatch, "gyro"), (ImuBatch, "accel")],
    ids=["points", "gyro", "accel"],
)
@pytest.mark.parametrize("at", [1.0, 8.0], ids=["at_rest", "in_flight"])
def test_values_that_are_not_finite_are_refused_by_name(run, head, name, kind, field, at):
    """What comes from a recording is filtered; whoever feeds an estimator directly is told."""
    with pytest.raises(ValueError, match=rf"{field}: .*not finite"):
        run(name, batches=poisoned(head.batches, kind, field, at=at))


@pytest.mark.parametrize("kind", [LidarBatch, ImuBatch], ids=["lidar", "imu"])
def test_times_that_go_back_are_refused_by_name(run, head, name, kind):
    """Within a batch or from one to the next."""
    batches = list(head.batches)
    i = next(i for i, b in enumerate(batches) if isinstance(b, kind) and b.times[0] >= 8.0)
    batches[i] = replace(batches[i], times=batches[i].times - 0.5)
    with pytest.raises(ValueError, match=r"times|stamps"):
        run(name, batches=batches)


def test_without_an_imu_in_the_payload_the_lidar_stands_for_it(head, case, name):
    payload = head.payload.model_copy(update={"imu": None, "T_imu_lidar": None})
    if case.needs_imu:
        with pytest.raises(PayloadError, match="an IMU and there is none"):
            odometry.create(name, payload, None, 1)
        return
    engine = odometry.create(name, payload, None, 1)
    for batch in of_kind(head.batches, LidarBatch):
        if batch.times[0] < 4.0:
            engine.feed(batch)
    estimate = engine.result()
    assert np.isfinite(estimate.trajectory.positions).all()
    assert estimate.calibration.latency == 0.0
    assert estimate.calibration.mount.T_imu_lidar.translation.tolist() == [0.0, 0.0, 0.0]


def test_a_lidar_behind_the_zero_of_its_encoder_is_where_it_is_without(quick, head, name):
    """The zero turns the lidar by as much as the mount behind the motor turns it back."""
    until = 7.0  # s; the motor does not move
    batches = [b for b in head.batches if b.times[-1] < until]
    batches = [
        replace(b, angles=np.zeros(len(b.times))) if isinstance(b, LidarBatch) else b
        for b in batches
    ]
    lidar = head.payload.T_imu_lidar.pose
    found = []
    for zero in (0.0, 1.2):
        back = Pose(np.zeros(3), geometry.exp(np.array([-zero, 0.0, 0.0]))) @ lidar
        transform = Transform(
            translation=back.translation.tolist(), quaternion=back.quaternion.tolist()
        )
        encoder = Encoder(axis=(1.0, 0.0, 0.0), zero=zero, T_motor_lidar=transform)
        payload = head.payload.model_copy(update={"T_imu_lidar": None, "encoder": encoder})
        engine = odometry.create(name, payload, quick[name], 1)
        for batch in batches:
            engine.feed(batch)
        found.append(engine.result())
    without, behind = found
    apart = behind.trajectory.positions - without.trajectory.positions
    assert np.abs(apart).max() < 1e-3
    mounts = [estimate.calibration.mount.lidar_at(0.0).matrix for estimate in found]
    assert np.abs(mounts[1] - mounts[0]).max() < 1e-3
