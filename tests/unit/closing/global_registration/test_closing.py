# SPDX-License-Identifier: MIT OR Apache-2.0
"""A room of exact planes, seen by a spinning lidar on a trajectory that is known exactly."""

from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.range_bias import RangeBias
from bentwing.base.trajectory import Trajectory
from bentwing.closing.global_registration import GlobalSettings, close_loops
from bentwing.closing.localize.map_surfels import SurfelMaker, core_surfels
from bentwing.odometry.continuous.settings import SurfelSettings
from bentwing.recording import ImuBatch, LidarBatch, Payload

PAYLOAD = Payload.model_validate(
    {"T_imu_lidar": {}, "lidar": {"range_sigma": 1e-3}}
)  # exact points
ROOM = np.array([[-4.0, 5.0], [-3.0, 4.0], [-1.5, 1.8]])
SECONDS = 30.0
LAP = 10.0


def poses(times):
    s = 2 * np.pi * times / LAP
    positions = np.stack([np.cos(s), 0.8 * np.sin(s), 0.2 * np.sin(2 * s)], axis=1)
    return positions, geometry.exp(times[:, None] * np.array([0.1, 0.2, 5.0]))


def truth(start=0.0, stop=SECONDS):
    times = np.arange(start, stop, 0.01)
    return Trajectory(times, *poses(times))


def scans(start=0.0, stop=SECONDS):
    """Points of a line of a 2D lidar, whose plane contains the axis that it is turned about."""
    rng = np.random.default_rng(3)
    for begin in np.arange(start, stop - 0.06, 0.05):
        times = begin + np.linspace(0.0, 0.05, 500, endpoint=False)
        angles = rng.uniform(0, 2 * np.pi, 500)
        rays = np.stack([np.cos(angles), np.zeros(500), np.sin(angles)], axis=1)
        positions, quats = poses(times)
        seen = geometry.rotate(quats, rays)
        seen = np.where(np.abs(seen) < 1e-9, 1e-9, seen)
        far = np.where(seen > 0, ROOM[:, 1] - positions, ROOM[:, 0] - positions) / seen
        yield LidarBatch(rays * far.min(axis=1)[:, None], times)


def inertial(stop=SECONDS):
    """What an ideal IMU feels on that trajectory, whose rate is constant."""
    times = np.arange(0.0, stop, 0.005)
    s = 2 * np.pi / LAP
    waves = np.array([1.0, 0.8, 0.2]) * np.array([1.0, 1.0, 4.0]) * s**2
    phases = s * times
    shapes = np.stack([np.cos(phases), np.sin(phases), np.sin(2 * phases)], axis=1)
    force = np.array([0.0, 0.0, 9.8]) - waves * shapes
    felt = geometry.rotate(geometry.inverse(poses(times)[1]), force)
    yield ImuBatch(times, np.tile([0.1, 0.2, 5.0], (len(times), 1)), felt)


def wrong_ranges(offset, stop=SECONDS):
    """The same scans with ranges that are too long."""
    for batch in scans(0.0, stop):
        far = np.linalg.norm(batch.points, axis=1)[:, None]
        yield replace(batch, points=batch.points * (1.0 + offset / far))


def closed_with_imu(offset, **settings):
    """What becomes of the exact trajectory, of an estimate with an IMU, if ranges are too long."""
    given = estimate(truth(0.0, 20.0))
    calibration = replace(
        given.calibration, std={"gyro_bias": [1e-4] * 3, "accel_bias": [0.01] * 3}
    )
    return close_loops(
        replace(given, calibration=calibration),
        [*inertial(20.0), *wrong_ranges(offset, 20.0)],
        Payload.model_validate({"T_imu_lidar": {}, "imu": {}, "lidar": {"range_sigma": 1e-3}}),
        settings=GlobalSettings(**settings),
        threads=2,
    )


def bent(trajectory):
    """The same with a drift of centimetres that is zero at the start."""
    times = trajectory.times
    shape = (1 - np.cos(2 * np.pi * (times - times[0]) / 37.0))[:, None]
    turn = geometry.exp(shape * np.array([0.002, -0.001, 0.004]))
    positions = trajectory.positions + shape * np.array([0.03, -0.02, 0.015])
    return Trajectory(times, positions, geometry.multiply(turn, trajectory.quats_xyzw))


def estimate(trajectory, segments=()):
    level = Pose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]))
    calibration = Calibration(
        0.0, FixedMount(level), np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.8])
    )
    return Estimate(trajectory, calibration, segments=list(segments))


def off(trajectory, times=None):
    times = trajectory.times if times is None else times
    found, _ = trajectory.interpolate(times)
    return np.linalg.norm(found - poses(times)[0], axis=1).max()


@pytest.fixture(scope="module")
def closed():
    return close_loops(estimate(bent(truth())), scans(), PAYLOAD, threads=2)


def test_a_slow_drift_is_taken_out(closed):
    assert off(bent(truth())) > 0.06
    assert closed.record["applied"], closed.record
    assert off(closed.estimate.trajectory) < 0.004
    assert closed.record["largest_translation"] == pytest.approx(off(bent(truth())), rel=0.1)
    assert closed.record["n_revisits"] > 0
    assert not closed.warnings


def test_over_ten_metres_a_pose_is_no_less_certain_than_since_the_start_and_once_more(closed):
    """Laps of six metres: what lies ten metres back was seen again, and errors do not add up."""
    found = closed.estimate
    whole = np.einsum("kii->ki", found.covariances.matrices)
    assert (whole[1:, 3:] > 0.0).all()
    assert (found.short_variances > 0.0).all()
    assert (found.short_variances[3:] < 4.0 * whole[:, 3:].max()).all()


def test_the_result_does_not_depend_on_threads(closed):
    again = close_loops(estimate(bent(truth())), scans(), PAYLOAD, threads=1)
    assert np.array_equal(again.estimate.trajectory.positions, closed.estimate.trajectory.positions)


def test_segments_are_pieces_that_find_each_other():
    first, second = bent(truth(0.0, 12.0)), truth(14.0, SECONDS)
    moved = replace(second, positions=second.positions + np.array([0.1, -0.06, 0.04]))
    times = np.linspace(0.0, 29.98, 2999)
    both = Trajectory(
        np.concatenate([first.times, moved.times]),
        np.concatenate([first.positions, moved.positions]),
        np.concatenate([first.quats_xyzw, moved.quats_xyzw]),
    )
    whole = Trajectory(times, *both.interpolate(times))
    spans = [(0.0, 11.99), (14.0, float(times[-1]))]
    found = close_loops(estimate(whole, spans), scans(), PAYLOAD, threads=2)
    assert found.record["applied"], found.record
    after = found.estimate.trajectory.times
    assert off(found.estimate.trajectory, after[after > 14.1]) < 0.01


def test_less_memory_takes_fewer_surfels_and_the_same_drift():
    settings = GlobalSettings(memory_mb=28.0)
    found = close_loops(estimate(bent(truth())), scans(), PAYLOAD, settings=settings, threads=2)
    assert found.record["budget"].is_thinned
    assert found.record["n_surfels"] <= found.record["budget"].n_surfels + 100
    assert off(found.estimate.trajectory) < 0.01


def test_what_does_not_settle_is_left_as_it_was():
    given = estimate(bent(truth()))
    settings = GlobalSettings(max_outer=1)
    found = close_loops(given, scans(), PAYLOAD, settings=settings, threads=2)
    assert not found.record["applied"]
    assert "did not settle in 1 iterations" in found.record["reason"]
    assert np.array_equal(found.estimate.trajectory.positions, given.trajectory.positions)
    assert "the trajectory is open-loop" in found.warnings[0]


def test_a_recording_without_points_is_left_as_it_was():
    found = close_loops(estimate(truth()), iter(()), PAYLOAD)
    assert found.record["reason"] == "there are no points along the trajectory"


def room_points(n=400_000):
    rng = np.random.default_rng(5)
    points = rng.uniform(ROOM[:, 0], ROOM[:, 1], (n, 3))
    axis, side = rng.integers(0, 3, n), rng.integers(0, 2, n)
    points[np.arange(n), axis] = ROOM[axis, side]
    return points


def map_of_room(origin):
    maker, points = SurfelMaker(SurfelSettings()), room_points()
    maker.add(points, None if origin is None else np.broadcast_to(origin, points.shape))
    return maker.levels()


@pytest.mark.parametrize("origin", [None, [0.3, 0.2, 0.1]], ids=["cloud", "run"])
def test_a_bent_trajectory_comes_to_the_map_and_the_map_stays(origin):
    known = core_surfels(map_of_room(origin))
    drifted = bent(truth())
    moved = replace(drifted, positions=drifted.positions + np.array([0.2, -0.1, 0.15]))
    found = close_loops(estimate(moved), scans(), PAYLOAD, known=known, threads=2)
    assert found.record["applied"], found.record
    assert off(moved) > 0.2
    assert off(found.estimate.trajectory) < 0.004


def test_a_registration_with_a_map_that_fails_does_not_call_the_trajectory_open_loop():
    known = core_surfels(map_of_room(None))
    settings = GlobalSettings(max_outer=1)
    found = close_loops(
        estimate(bent(truth())), scans(), PAYLOAD, settings=settings, known=known, threads=2
    )
    assert not found.record["applied"]
    assert "not registered with the map" in found.warnings[0]


def test_ranges_that_are_too_long_are_found_and_exact_ones_left_bit_for_bit():
    found = closed_with_imu(0.025)
    assert found.record["applied"], found.record
    calibration = found.estimate.calibration
    (std,) = calibration.std["range_offset"]
    assert calibration.ranges.offset == pytest.approx(0.025, abs=1.5e-3)
    assert std < 2e-3
    assert calibration.ranges.grazing == 0.0
    assert "range_grazing" not in calibration.std
    exact, unasked = (
        closed_with_imu(0.0, frozen=frozen) for frozen in ((), ("range_offset", "range_grazing"))
    )
    assert exact.estimate.calibration.ranges == RangeBias()
    assert "range_offset" not in exact.estimate.calibration.std
    for name in ("positions", "quats_xyzw"):
        assert np.array_equal(
            getattr(exact.estimate.trajectory, name), getattr(unasked.estimate.trajectory, name)
        )


def test_ranges_stay_as_they_are_where_they_are_frozen_or_there_is_no_imu():
    frozen = closed_with_imu(0.025, frozen=("range_offset",))
    assert frozen.estimate.calibration.ranges.offset == 0.0
    alone = close_loops(estimate(truth()), wrong_ranges(0.025), PAYLOAD, threads=2)
    assert alone.estimate.calibration.ranges == RangeBias()


def test_a_state_that_is_none_cannot_be_frozen():
    with pytest.raises(ValueError, match="unknown states \\['range_scale'\\]; choose from"):
        GlobalSettings(frozen=("range_scale",))
