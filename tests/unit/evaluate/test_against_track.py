# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.against_track import compare_with_track
from bentwing.evaluate.alignment import Alignment
from bentwing.evaluate.drift_boxes import drift_boxes
from bentwing.evaluate.relative import rotational_error, translational_error
from bentwing.evaluate.robust import fit_line
from bentwing.evaluate.track import Track

ORIGIN = 1_700_000_000_000_000_000


@pytest.fixture(scope="module")
def estimate(flight):
    return flight(np.arange(0, 60, 0.01))


@pytest.fixture(scope="module")
def noisy(estimate):
    rng = np.random.default_rng(3)
    n = len(estimate.times)
    turns = geometry.exp(rng.normal(0, 0.004, (n, 3)))
    drifted = estimate.positions + np.cumsum(rng.normal(0, 2e-4, (n, 3)), axis=0)
    return Trajectory(estimate.times, drifted, geometry.multiply(turns, estimate.quats_xyzw))


def positions_seen(flight, elsewhere, *, arm=(0, 0, 0), offset=0.0, rate=7.0, noise=0.0, seed=0):
    """What a total station measures of a point on the carrier, its clock ahead by `offset`."""
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.7, 1.3, 300)) / rate + 4.0
    poses = flight(times[times < 55])
    points = geometry.compose(poses.positions, poses.quats_xyzw, np.array(arm))
    placed = points @ elsewhere.R.T + elsewhere.t + rng.normal(0, noise, points.shape)
    first = float(poses.times[0])
    return Track(poses.times - first, placed, None, ORIGIN + round(1e9 * (first + offset)))


def every(step, poses):
    return Trajectory(*(v[::step] for v in (poses.times, poses.positions, poses.quats_xyzw)))


def as_track(poses):
    return Track(poses.times, poses.positions, poses.quats_xyzw, ORIGIN)


@pytest.mark.parametrize("offset", [0.0, -3.21, 86_400.5])
def test_clock_offset_and_lever_arm_of_a_total_station_are_recovered(
    flight, elsewhere, estimate, offset
):
    track = positions_seen(flight, elsewhere, arm=(0.12, -0.07, 0.25), offset=offset, noise=0.003)
    found = compare_with_track(estimate, ORIGIN, track)
    point = found.tracked_point
    # 3 mm over 300 positions at 2 m/s: 0.1 ms and 0.3 mm, five times each
    assert point.clock_offset == pytest.approx(offset, abs=5e-4)
    assert np.allclose(point.lever_arm, [0.12, -0.07, 0.25], atol=1.5e-3)
    assert np.abs(found.alignment.R - elsewhere.R).max() < 1e-3
    assert found.absolute.rmse == pytest.approx(0.003 * np.sqrt(3), rel=0.15)
    for box in found.axes.values():
        assert box.std == pytest.approx(0.003, rel=0.2)
    assert found.rotation is None
    assert found.rte is None


def test_a_given_lever_arm_and_clock_offset_are_taken_as_they_are(flight, elsewhere, estimate):
    track = positions_seen(flight, elsewhere, arm=(0.3, 0, 0), offset=2.0)
    found = compare_with_track(estimate, ORIGIN, track, clock_offset=2.0, lever_arm=(0.3, 0, 0))
    assert found.tracked_point.lever_arm == (0.3, 0, 0)
    assert found.tracked_point.clock_offset_found is None
    assert found.absolute.rmse < 2e-4  # of interpolating the circle
    without = compare_with_track(estimate, ORIGIN, track, clock_offset=2.0, lever_arm=(0, 0, 0))
    assert without.absolute.rmse > 0.1


def test_a_tenth_of_gross_errors_does_not_move_clock_and_lever_arm(flight, elsewhere, estimate):
    track = positions_seen(flight, elsewhere, arm=(0.1, 0, 0.2), offset=1.5, noise=0.003)
    track.positions[40:70] += [0.8, -0.5, 0.3]
    point = compare_with_track(estimate, ORIGIN, track).tracked_point
    assert point.clock_offset == pytest.approx(1.5, abs=1e-3)
    assert np.allclose(point.lever_arm, [0.1, 0, 0.2], atol=3e-3)


def test_what_the_motion_does_not_show_of_a_lever_arm_is_uncertain(flight):
    level = flight(np.arange(0, 60, 0.01))
    heading = geometry.exp(np.outer(0.9 * level.times, [0, 0, 1.0]))
    level = Trajectory(level.times, level.positions, heading)
    at = np.arange(2, 58, 0.15)
    points = geometry.compose(*level.interpolate(at), np.array([0.2, 0.1, 0.4]))
    track = Track(at, points, None, ORIGIN)
    point = compare_with_track(level, ORIGIN, track).tracked_point
    assert np.allclose(point.lever_arm[:2], [0.2, 0.1], atol=1e-3)
    assert max(point.lever_arm_std[:2]) < 0.01 < 0.5 < point.lever_arm_std[2]


def test_stamps_of_poses_within_ten_milliseconds_are_the_same_clock(flight, estimate):
    shifted = as_track(flight(np.arange(1, 50, 0.02) + 0.004)).moved_in_time(-0.004)
    point = compare_with_track(estimate, ORIGIN, shifted).tracked_point
    assert point.clock_offset == 0.0
    assert point.clock_offset_found == pytest.approx(-0.004, abs=1e-5)


def test_a_pose_reference_on_another_clock_is_found(flight, estimate):
    poses = flight(np.arange(5, 50, 0.02))
    track = Track(poses.times - 5, poses.positions, poses.quats_xyzw, 123_000_000_000)
    found = compare_with_track(estimate, ORIGIN, track)
    assert found.tracked_point.clock_offset == pytest.approx(118 - 1_700_000_000, abs=1e-4)
    assert found.absolute.maximum < 1e-3


def straight(n=100, *, noise=0.0, turn=(0.0, 0.0, 0.0)):
    """A drive along a line at constant speed, level."""
    times = np.arange(n) / 10
    positions = np.outer(2.0 * times, [1.0, 0.0, 0.0])
    positions = positions + np.random.default_rng(1).normal(0, noise, (n, 3))
    quats = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    turned = geometry.to_matrices(geometry.exp(np.array(turn)))
    return Trajectory(
        times, positions @ turned.T, geometry.multiply(geometry.exp(np.array(turn)), quats)
    )


@pytest.mark.parametrize("turn", [(0.0, 0.0, 0.0), (1.6, 0.0, 0.0), (0.3, -0.5, 2.0)])
def test_a_straight_path_takes_the_turn_about_it_from_the_orientations(turn):
    found = compare_with_track(straight(noise=0.003), ORIGIN, as_track(straight(turn=turn)))
    assert found.is_straight
    assert found.tracked_point.clock_offset == 0.0
    assert found.rotation.as_is.maximum < np.radians(0.05)
    assert found.absolute.maximum < 0.02
    assert found.error_over_speed is None


def test_heading_does_not_drift_on_a_straight_path_that_is_off_by_noise():
    (five, *_) = drift_boxes(straight(noise=0.02), straight())
    assert abs(five.heading.median) < 1e-9


def test_without_orientations_nothing_tells_the_turn_about_a_straight_path():
    reference = straight()
    track = Track(reference.times, reference.positions, None, ORIGIN)
    assert compare_with_track(straight(noise=0.01), ORIGIN, track).is_straight


def test_a_path_that_bends_is_aligned_by_its_positions(noisy, estimate):
    assert not compare_with_track(noisy, ORIGIN, as_track(every(5, estimate))).is_straight


def test_a_short_path_whose_stamps_agree_is_not_moved_far_in_time(flight, estimate):
    # Another second of the flight happens to look alike, but the stamps say which one it is.
    poses = flight(np.arange(20.0, 21.4, 0.01))
    noise = np.random.default_rng(4).normal(0, 0.004, poses.positions.shape)
    short = Trajectory(poses.times, poses.positions + noise, poses.quats_xyzw)
    point = compare_with_track(short, ORIGIN, as_track(estimate)).tracked_point
    assert point.clock_offset == 0.0


def test_recordings_of_different_flights_are_refused(estimate):
    short = Track(
        *(v[:5] for v in (np.arange(5.0), np.random.default_rng(0).normal(size=(5, 3)))),
        None,
        ORIGIN,
    )
    with pytest.raises(InputError, match="fewer than 10"):
        compare_with_track(estimate, ORIGIN, short)
    still = Track(np.arange(0, 50, 0.1), np.zeros((500, 3)), None, ORIGIN)
    with pytest.raises(InputError, match="do not vary"):
        compare_with_track(estimate, ORIGIN, still)
    late = Track(np.arange(0, 50, 0.1), np.zeros((500, 3)), None, ORIGIN + 10**12)
    with pytest.raises(InputError, match="is the clock offset right"):
        compare_with_track(estimate, ORIGIN, late, clock_offset=0.0)


def for_evo(poses):
    from evo.core.trajectory import PoseTrajectory3D

    return PoseTrajectory3D(poses.positions, np.roll(poses.quats_xyzw, 1, axis=1), poses.times)


@pytest.mark.parametrize("step", [1, 4])
def test_absolute_errors_agree_with_evo(estimate, noisy, elsewhere, step):
    metrics = pytest.importorskip("evo.core.metrics", reason="evo is not installed")
    from evo.core import sync

    moved = elsewhere.apply(noisy)
    moved, sparse = every(5, moved), every(5 * step, estimate)
    ours = compare_with_track(moved, ORIGIN, as_track(sparse), clock_offset=0.0)
    reference, theirs = sync.associate_trajectories(for_evo(sparse), for_evo(moved))
    theirs.align(reference)
    for relation, found in (
        (metrics.PoseRelation.translation_part, ours.absolute),
        (metrics.PoseRelation.rotation_angle_rad, ours.rotation.as_is),
    ):
        ape = metrics.APE(relation)
        ape.process_data((reference, theirs))
        expected = ape.get_all_statistics()
        for name, value in (("rmse", found.rmse), ("mean", found.mean), ("median", found.median),
                            ("std", found.std), ("min", found.minimum), ("max", found.maximum)):  # fmt: skip
            assert value == pytest.approx(expected[name], rel=1e-6)


def test_relative_errors_agree_with_evo(estimate, noisy, elsewhere):
    metrics = pytest.importorskip("evo.core.metrics", reason="evo is not installed")
    moved, estimate = every(5, elsewhere.apply(noisy)), every(5, estimate)
    ours = compare_with_track(moved, ORIGIN, as_track(estimate), clock_offset=0.0)
    assert [part.delta for part in ours.relative] == [1.0, 10.0]
    for part in ours.relative:
        for relation, found in (
            (metrics.PoseRelation.translation_part, part.translation),
            (metrics.PoseRelation.rotation_angle_rad, part.rotation),
            (metrics.PoseRelation.point_distance, part.distance),
        ):
            rpe = metrics.RPE(relation, part.delta, metrics.Unit.meters, pairs_from_reference=True)
            rpe.process_data((for_evo(estimate), for_evo(moved)))
            expected = rpe.get_all_statistics()
            assert found.n == len(rpe.error)
            assert found.rmse == pytest.approx(expected["rmse"], rel=1e-6)
            assert found.maximum == pytest.approx(expected["max"], rel=1e-6)


def test_a_scale_error_of_one_percent_is_one_percent_of_the_way(estimate):
    stretched = Trajectory(estimate.times, 1.01 * estimate.positions, estimate.quats_xyzw)
    found = compare_with_track(stretched, ORIGIN, as_track(estimate), clock_offset=0.0)
    for part in found.relative:
        # chords are shorter than the way, by a third over 10 m of these bends
        assert part.translation.mean == pytest.approx(
            0.01 * part.delta, rel=0.03 if part.delta == 1 else 0.4
        )
        assert part.distance.mean == pytest.approx(part.translation.mean, rel=1e-6)


def test_a_constant_difference_of_frames_is_no_error(estimate, elsewhere):
    found = compare_with_track(
        elsewhere.apply(estimate), ORIGIN, as_track(estimate), clock_offset=0.0
    )
    assert found.absolute.maximum < 1e-10
    assert found.rotation.as_is.maximum < 1e-7
    assert found.rte.maximum < 1e-10
    assert found.rre.maximum < 1e-7


@settings(max_examples=10, deadline=None)
@given(
    st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    st.lists(st.floats(-1e3, 1e3), min_size=3, max_size=3),
)
def test_no_error_depends_on_the_frame_of_the_estimate(estimate, noisy, turn, shift):
    move = Alignment(geometry.to_matrices(geometry.exp(np.array(turn))), np.array(shift))
    estimate, noisy = every(10, estimate), every(10, noisy)
    a, b = (
        compare_with_track(poses, ORIGIN, as_track(estimate), clock_offset=0.0)
        for poses in (noisy, move.apply(noisy))
    )
    assert b.absolute.rmse == pytest.approx(a.absolute.rmse, rel=1e-6)
    assert b.rotation.as_is.rmse == pytest.approx(a.rotation.as_is.rmse, rel=1e-6)
    assert b.relative[0].translation.rmse == pytest.approx(a.relative[0].translation.rmse, rel=1e-6)
    assert b.rte.mean == pytest.approx(a.rte.mean, rel=1e-6)


def test_an_error_that_grows_with_speed_has_the_slope_of_the_line():
    rng = np.random.default_rng(0)
    speeds = rng.uniform(0, 2, 500)
    errors = 0.01 + 0.05 * speeds + rng.normal(0, 0.002, 500)
    errors[:100] += rng.uniform(0.5, 3, 100)
    line = fit_line(speeds, errors)
    assert line.slope == pytest.approx(0.05, abs=1e-3)
    assert line.intercept == pytest.approx(0.01, abs=1e-3)
    assert fit_line(np.ones(10), errors[:10]) is None
    exact = fit_line(np.arange(5.0), 2 * np.arange(5.0) + 1)
    assert (exact.slope, exact.intercept) == pytest.approx((2, 1))


def test_tazirs_errors_are_the_distance_and_root_two_angles():
    a, b = np.zeros((2, 3)), np.array([[3.0, 4, 0], [0, 0, 2]])
    assert translational_error(a, b).tolist() == [5, 2]
    turned = geometry.exp(np.array([[0.3, 0, 0], [0, 0, -1.2]]))
    none = np.tile([0.0, 0, 0, 1], (2, 1))
    assert np.allclose(rotational_error(none, turned), np.sqrt(2) * np.array([0.3, 1.2]))


def test_measurements_in_a_silence_of_the_estimate_are_not_compared(flight, estimate):
    keep = (estimate.times < 20) | (estimate.times > 30)
    torn = Trajectory(*(v[keep] for v in (estimate.times, estimate.positions, estimate.quats_xyzw)))
    found = compare_with_track(
        torn, ORIGIN, as_track(flight(np.arange(0.0, 59, 0.05))), clock_offset=0.0
    )
    assert not ((found.times > 20) & (found.times < 30)).any()
    assert found.n_unmatched == pytest.approx(200, abs=3)
    assert found.absolute.maximum < 1e-3


def test_drift_boxes_hold_a_stretched_way_and_a_slow_turn():
    t = 0.01 * np.arange(6000)
    way = np.stack([t, 0.2 * np.sin(0.5 * t), 0.1 * np.cos(0.7 * t)], axis=1)
    still = np.tile([0.0, 0, 0, 1], (len(t), 1))
    truth = Trajectory(t, way, still)
    found = drift_boxes(Trajectory(t, way * [1.003, 1, 1], still), truth)
    assert [part.length for part in found] == [5, 10, 20, 50]
    for part in found:
        # half of the pooled horizontal values are forward, 3 mm per m, half sideways, near 0
        assert part.horizontal.p97 == pytest.approx(0.003, rel=0.05)
        assert abs(part.vertical.median) < 2e-5
    turning = Trajectory(t, way, geometry.exp(np.outer(1e-4 * t, [0, 0, 1.0])))
    for part in drift_boxes(turning, truth):
        assert part.heading.median == pytest.approx(1e-4, rel=0.03)
        assert abs(part.tilt.median) < 1e-6


def test_without_alignment_the_coordinates_count_in_which_the_map_is_written(estimate):
    """A georeferenced run whose trajectory is local, against a reference in its projected system."""
    place = np.array([500_000.0, 5_300_000.0, 400.0])
    reference = Trajectory(estimate.times, estimate.positions + place, estimate.quats_xyzw)
    track = as_track(reference)
    local = compare_with_track(estimate, ORIGIN, track).unaligned
    assert local.position.median == pytest.approx(float(np.linalg.norm(place)), rel=1e-6)
    written = compare_with_track(estimate, ORIGIN, track, written=lambda p: p + place).unaligned
    assert written.position.maximum < 1e-6
    assert {name: box.mean for name, box in written.axes.items()} == pytest.approx(
        {"x": 0.0, "y": 0.0, "z": 0.0}, abs=1e-6
    )
