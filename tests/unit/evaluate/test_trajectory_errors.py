# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from evo.core import metrics, trajectory

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.alignment import Alignment, align
from bentwing.evaluate.trajectory import absolute_error, drift

MOVE = Alignment(
    geometry.to_matrices(geometry.exp(np.array([0.3, -0.2, 2.0]))), np.array([5.0, -3, 1])
)


def truth(n=2000):
    t = 0.01 * np.arange(n)
    positions = np.stack([8 * np.cos(0.3 * t), 8 * np.sin(0.3 * t), 2 + 0.5 * np.sin(t)], axis=1)
    turns = np.stack([0.1 * np.sin(t), 0.1 * np.cos(t), np.mod(4.3 * t + 3, 6) - 3], axis=1)
    return Trajectory(t, positions, geometry.exp(turns))


def noisy(seed=0, position=0.02, rotation=0.01):
    exact, rng = truth(), np.random.default_rng(seed)
    n = len(exact.times)
    turns = geometry.exp(rng.normal(0, rotation, (n, 3)))
    quats = geometry.multiply(turns, exact.quats_xyzw)
    return Trajectory(exact.times, exact.positions + rng.normal(0, position, (n, 3)), quats)


def for_evo(path):
    return trajectory.PoseTrajectory3D(
        path.positions, np.roll(path.quats_xyzw, 1, axis=1), path.times
    )


def test_absolute_error_agrees_with_evo():
    ours = absolute_error(MOVE.apply(noisy()), truth())
    reference, estimate = for_evo(truth()), for_evo(MOVE.apply(noisy()))
    estimate.align(reference)
    ape = metrics.APE(metrics.PoseRelation.translation_part)
    ape.process_data((reference, estimate))
    theirs = ape.get_all_statistics()
    for name, value in (("rmse", ours.position.rmse), ("mean", ours.position.mean),
                        ("median", ours.position.median), ("max", ours.position.maximum)):  # fmt: skip
        assert value == pytest.approx(theirs[name], rel=1e-9)


def test_a_moved_copy_of_the_truth_has_no_error():
    copy_of_truth = MOVE.apply(truth())
    assert absolute_error(copy_of_truth, truth()).position.maximum < 1e-12
    (ten,) = drift(copy_of_truth, truth())
    assert ten.horizontal_median < 1e-8


def test_the_estimate_is_interpolated_at_the_stamps_of_the_truth():
    fine = truth()
    t = np.arange(0.003, 15, 0.02)
    coarse = Trajectory(t, *fine.interpolate(t))
    assert absolute_error(coarse, fine).position.maximum < 1e-3
    assert absolute_error(coarse, fine).times[0] == pytest.approx(0.01)


def test_only_the_given_interval_counts():
    estimate = noisy(position=0.0)
    early = estimate.times < 5
    estimate.positions[early] += np.array([0.0, 0.0, 3.0])
    assert absolute_error(estimate, truth(), during=(5.0, 15.0)).position.maximum < 1e-9


def test_yaw_only_alignment_shows_what_a_full_one_hides():
    tilt = Alignment(geometry.to_matrices(geometry.exp(np.array([0.01, 0, 0]))), np.zeros(3))
    tilted = tilt.apply(truth())
    assert absolute_error(tilted, truth()).position.rmse < 1e-9
    found = absolute_error(tilted, truth(), yaw_only=True)
    assert found.vertical == pytest.approx(0.01 * 8 / np.sqrt(2), rel=0.1)


def test_yaw_only_alignment_finds_the_yaw():
    turn = geometry.to_matrices(geometry.exp(np.array([0, 0, 2.5])))
    found = align(truth().positions, truth().positions @ turn.T + [1.0, 2, 3], yaw_only=True)
    assert np.allclose(found.R, turn)
    assert np.allclose(found.t, [1, 2, 3])


def test_alignment_never_mirrors():
    points = np.random.default_rng(0).normal(size=(50, 3))
    assert np.linalg.det(align(points, points * [1, 1, -1]).R) == pytest.approx(1.0)


def test_a_constant_turn_of_the_imu_frame_is_no_drift():
    turn = geometry.exp(np.array([0.0, 0.0, np.radians(0.5)]))
    turned = Trajectory(
        truth().times, truth().positions, geometry.multiply(truth().quats_xyzw, turn)
    )
    (ten,) = drift(turned, truth())
    assert ten.horizontal_median < 1e-8  # 9 mm/m if the turn were not removed
    error = absolute_error(turned, truth())
    assert error.frame_rotation == pytest.approx(np.radians(0.5), rel=1e-9)
    assert error.rotation.maximum < 1e-7


def straight(scale=(1.0, 1.0, 1.0), yaw_rate=0.0):
    t = 0.01 * np.arange(6000)
    way = np.stack([t, 0.2 * np.sin(0.5 * t), 0.1 * np.cos(0.7 * t)], axis=1) * scale
    return Trajectory(t, way, geometry.exp(np.stack([0 * t, 0 * t, yaw_rate * t], axis=1)))


def test_drift_per_metre_is_that_of_a_stretched_way():
    found = drift(straight((1.003, 1, 1)), straight(), lengths=(5.0, 20.0, 500.0))
    assert [d.length for d in found] == [5.0, 20.0]
    for result in found:
        assert result.horizontal_median == pytest.approx(0.003, rel=0.05)
        assert result.vertical_median < 3e-5


def test_vertical_drift_is_told_from_horizontal():
    climbing = straight()
    climbing = Trajectory(
        climbing.times,
        climbing.positions + np.outer(climbing.times, [0, 0, 0.002]),
        climbing.quats_xyzw,
    )
    found = drift(climbing, straight(), lengths=(10.0,), during=(0.0, 59.0))[0]
    # alignment takes the slope out as a tilt, so its trace is in roll and pitch of the frame
    assert found.vertical_median < 0.0021
    assert found.horizontal_median < 2e-4


def test_standing_still_adds_no_segments():
    moving = straight()
    wait = Trajectory(
        np.concatenate([moving.times, moving.times[-1] + 0.01 * np.arange(1, 6000)]),
        np.vstack([moving.positions, np.repeat(moving.positions[-1:], 5999, 0)]),
        np.vstack([moving.quats_xyzw, np.repeat(moving.quats_xyzw[-1:], 5999, 0)]),
    )
    assert len(drift(wait, wait)[0].vertical) == len(drift(moving, moving)[0].vertical)


def test_trajectories_that_do_not_overlap_are_refused():
    late = Trajectory(truth().times + 1e6, truth().positions, truth().quats_xyzw)
    with pytest.raises(InputError, match="share 0 stamps"):
        absolute_error(late, truth())
