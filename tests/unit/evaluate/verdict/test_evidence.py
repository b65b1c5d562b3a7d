# SPDX-License-Identifier: MIT OR Apache-2.0
"""Each kind of evidence by itself, on a flight whose truth is known by formula."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.breaks import Break
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, MotorErrors, Pose
from bentwing.base.plain import plain
from bentwing.base.trajectory import Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.evaluate.revisits import Revisits
from bentwing.evaluate.verdict import (
    KINDS,
    Evidence,
    Verdict,
    Watch,
    judge_breaks,
    judge_closing,
    judge_estimate,
    judge_revisits,
    judge_so_far,
    verdict_of,
)
from bentwing.evaluate.verdict.head import judge_calibration
from bentwing.recording import ImuBatch, LidarBatch, Payload
from bentwing.recording.described import described_calibration

PAYLOAD = Payload.model_validate(
    {
        "lidar": {"kind": "vlp16"},
        "imu": {"accel_noise": 0.01},
        "T_imu_lidar": {"translation": [0.1, 0, 0], "quaternion": [0, 0, 0, 1]},
    }
)
LENGTH, DT = 30.0, 0.01
G = np.array([0.0, 0.0, 9.80665])


def motion(times):
    """Positions, attitudes, and what an ideal IMU feels, of a carrier that circles, bobs and yaws."""
    w, yaw, rate = 0.8, 0.6 * np.sin(0.5 * times), 0.3 * np.cos(0.5 * times)
    positions = np.stack([2 * np.cos(w * times), 2 * np.sin(w * times), 0.5 * np.sin(times)], 1)
    accelerations = np.stack(
        [-2 * w**2 * np.cos(w * times), -2 * w**2 * np.sin(w * times), -0.5 * np.sin(times)], 1
    )
    zero = np.zeros_like(times)
    quats = geometry.exp(np.stack([zero, zero, yaw], 1))
    gyro = np.stack([zero, zero, rate], 1)
    return positions, quats, gyro, geometry.rotate(geometry.inverse(quats), accelerations + G)


def record(time, **changes):
    """What is usual of a window."""
    usual = {
        "n_surfels": 5000, "n_matches": 4000, "inlier_share": 0.996, "residual_rms": 0.25,
        "iterations": 4, "converged": True, "degenerate": False, "latency": 0.0,
        "translation_eigenvalues": [0.2, 0.3, 0.5],
    }  # fmt: skip
    return WindowRecord(time=time, **(usual | changes))


def estimate(**changes):
    times = np.arange(0.0, LENGTH, DT)
    positions, quats, _, _ = motion(times)
    std = {"gyro_bias": [1e-4] * 3, "accel_bias": [1e-3] * 3, "extrinsic_rotation": [1e-3] * 3}
    calibration = replace(described_calibration(PAYLOAD), std=std)
    windows = [record(float(t)) for t in np.arange(1.5, LENGTH, 1.5)]
    return replace(
        Estimate(Trajectory(times, positions, quats), calibration, windows=windows), **changes
    )


def watched(change=lambda _, gyro, accel: (gyro, accel), step=0.005):
    """What a watch has seen of the flight, its inertial samples changed."""
    watch, rng = Watch(), np.random.default_rng(3)
    times = np.arange(0.0, LENGTH, step)
    _, _, gyro, accel = motion(times)
    gyro = gyro + rng.normal(0, 5e-4 / np.sqrt(step), gyro.shape)
    accel = accel + rng.normal(0, 0.01 / np.sqrt(step), accel.shape)
    gyro, accel = change(times, gyro, accel)
    for rows in np.array_split(np.arange(len(times)), 100):
        watch.add(ImuBatch(times[rows], gyro[rows], accel[rows]))
    watch.add(room())
    return watch


def room(length=LENGTH):
    """Returns of a lidar that looks around between walls."""
    turns = np.linspace(0.0, 40 * np.pi, 4000)
    ranges = 5.0 + 2.0 * np.sin(2 * turns)
    up = np.sin(0.3 * turns)
    points = ranges[:, None] * np.stack([np.cos(turns), np.sin(turns), up], 1)
    return LidarBatch(points, np.linspace(0.0, length, 4000))


def kinds(found, watch):
    return {reason.kind for reason in verdict_of(judge_estimate(found, PAYLOAD, watch)).reasons}


def test_nothing_speaks_against_a_good_flight():
    verdict = verdict_of(judge_estimate(estimate(), PAYLOAD, watched()))
    assert (verdict.state, verdict.reasons) == ("good", ())
    assert {"gyro", "accelerometer", "matches", "gravity", "speed"} <= verdict.measures.keys()
    assert verdict.measures["gyro"] < KINDS["gyro"].doubtful / 1.5


LITTLE = np.array([0.01, 0.0, 0.0])  # rad/s


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (lambda _, g, a: (1.2 * g, a), "gyro"),
        (lambda _, g, a: (-g, a), "gyro"),
        (lambda _, g, a: (g[:, [2, 0, 1]], a), "gyro"),
        (lambda _, g, a: (g, a * [-1.0, 1.0, 1.0]), "accelerometer"),
        (lambda _, g, a: (g, a[:, [1, 0, 2]]), "accelerometer"),
        (lambda _, g, a: (g, 1.1 * a), "gravity"),
        (lambda _, g, a: (g, a - G), "gravity"),
        (lambda _, g, a: (g, a / 9.80665), "units"),
        (lambda _, g, a: (0.0 * g, a), "constant"),
        (lambda _, g, a: (np.clip(g, -0.2, 0.2), a), "gyro_limit"),
        (lambda t, g, a: (g[np.minimum(np.arange(len(t)), 3000)], a[np.minimum(np.arange(len(t)), 3000)]), "repeated"),
    ],
)  # fmt: skip
def test_an_imu_that_is_wrong_is_named(change, kind):
    assert kind in kinds(estimate(), watched(change))


@pytest.mark.parametrize(("registered", "is_doubted"), [(None, False), (True, True)])
def test_samples_at_a_limit_do_less_harm_where_the_estimator_bridges_them(registered, is_doubted):
    """Windows bridge them; the sweeps of the filter, whose records say whether they were registered, do not."""
    watch = watched()
    for start in (5.0, 15.0):
        times = LENGTH + start + 0.005 * np.arange(20)
        rest = np.zeros((20, 3))
        at_limit = np.zeros((20, 6), np.bool_)
        at_limit[:, 0] = True
        watch.imu.add(ImuBatch(times, rest + 1e-3 * times[:, None], rest + G, at_limit))
    found = estimate(windows=[record(float(t), registered=registered) for t in range(2, 30)])
    assert ("gyro_limit" in kinds(found, watch)) == is_doubted


@pytest.mark.parametrize("times", [0.8, 1.05, 1.3])
def test_ranges_of_a_wrong_scale_are_told_with_the_factor(times):
    found = estimate()
    scaled = replace(found.trajectory, positions=times * found.trajectory.positions)
    verdict = verdict_of(judge_estimate(replace(found, trajectory=scaled), PAYLOAD, watched()))
    (reason,) = [r for r in verdict.reasons if r.kind == "scale"]
    assert reason.value == pytest.approx(abs(times - 1.0), rel=0.1, abs=0.01)
    assert "times as long as the accelerometer says" in reason.sentence


def test_an_imu_that_samples_too_slowly_is_named():
    assert "imu_period" in kinds(estimate(), watched(step=0.1))


def test_an_imu_at_rest_that_repeats_its_last_digit_is_at_no_limit():
    def rounded(_, gyro, accel):
        return np.round(0 * gyro + np.sign(gyro) * 1e-3, 3), accel

    assert "gyro_limit" not in kinds(estimate(), watched(rounded))


def test_a_silent_imu_is_no_disagreement():
    silent = Watch()
    times = np.arange(0.0, LENGTH, 0.005)
    _, _, gyro, accel = motion(times)
    for rows in (times < 12.0, times > 13.5):
        silent.add(ImuBatch(times[rows], gyro[rows], accel[rows]))
    assert silent.track.gaps == [pytest.approx((12.0, 13.5), abs=0.02)]
    assert not kinds(estimate(), silent) & {"gyro", "accelerometer"}


def test_a_disagreement_says_when():
    def late(times, gyro, accel):
        return np.where(times[:, None] > 15.0, -gyro, gyro), accel

    found = verdict_of(judge_estimate(estimate(), PAYLOAD, watched(late)))
    (reason,) = [r for r in found.reasons if r.kind == "gyro"]
    assert all(first >= 14.0 for first, _ in reason.spans)
    assert "from 15" in reason.sentence


def test_a_bias_as_uncertain_as_stated_is_no_disagreement():
    unknown = described_calibration(PAYLOAD)
    std = {"gyro_bias": [0.02] * 3, "accel_bias": [0.1] * 3}
    found = estimate(calibration=replace(unknown, std=std))
    assert "gyro" not in kinds(found, watched(lambda _, g, a: (g + LITTLE, a)))
    assert "gyro" in kinds(estimate(), watched(lambda _, g, a: (g + LITTLE, a)))


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"inlier_share": 0.6}, "matches"),
        ({"n_matches": 3, "inlier_share": None}, "lost"),
        ({"translation_eigenvalues": [0.002, 0.4, 0.6]}, "unseen"),
    ],
)
def test_what_the_lidar_sees_must_fit(changes, kind):
    windows = [record(float(t), **changes) for t in np.arange(1.5, LENGTH, 1.5)]
    assert kinds(estimate(windows=windows), watched()) == {kind}


def test_one_moment_that_does_not_fit_is_no_fault():
    windows = estimate().windows
    windows[8] = record(windows[8].time, inlier_share=0.9)
    assert kinds(estimate(windows=windows), watched()) == set()


def test_the_moments_before_the_head_has_turned_do_not_count():
    windows = [replace(w, n_matches=2, inlier_share=0.3) if w.time < 4.0 else w for w in estimate().windows]  # fmt: skip
    assert kinds(estimate(windows=windows), watched()) == set()


@pytest.mark.parametrize(
    ("changes", "kind"),
    [({"gyro_rms": 6.0}, "gyro_noise"), ({"accel_rms": 6.0}, "accelerometer_noise")],
)
def test_an_imu_noisier_than_stated_is_doubted(changes, kind):
    windows = [replace(w, **changes) for w in estimate().windows]
    assert kinds(estimate(windows=windows), watched()) == {kind}


def test_an_accelerometer_whose_vibration_is_not_stated_is_no_fault():
    quiet = PAYLOAD.model_copy(update={"imu": PAYLOAD.imu.model_copy(update={"accel_noise": 8e-4})})
    windows = [replace(w, accel_rms=15.0) for w in estimate().windows]
    found = verdict_of(judge_estimate(estimate(windows=windows), quiet, watched()))
    assert found.state == "good"


def test_a_mount_far_from_the_payload_is_doubted():
    pose = Pose(np.array([0.1, 0, 0]), geometry.exp(np.radians([[0.0, 0, 9]]))[0])
    turned = replace(estimate().calibration, mount=FixedMount(pose))
    found = verdict_of(judge_estimate(estimate(calibration=turned), PAYLOAD, watched()))
    assert [reason.kind for reason in found.reasons] == ["calibration"]
    assert "the direction of the lidar" in found.reasons[0].sentence


@pytest.mark.parametrize(
    ("errors", "words"),
    [
        (
            MotorErrors(eccentricity=np.array([0.0, 0.02])),
            "how far off its axis the encoder's disc is",
        ),
        (
            MotorErrors(wobble=np.array([[0.0, 0.01, 0, 0], [0, 0, 0, 0]])),
            "the motor's shaft wobbles",
        ),
    ],
)
def test_a_motor_that_turns_far_from_the_payload_is_doubted(errors, words):
    identity = {"translation": [0, 0, 0], "quaternion": [0, 0, 0, 1]}
    payload = Payload.model_validate(
        {
            "lidar": {"kind": "vlp16"},
            "encoder": {"T_imu_motor": identity, "T_motor_lidar": identity},
        }
    )
    described = described_calibration(payload)
    std = {"encoder_eccentricity": [1e-4] * 2, "motor_wobble": [1e-4] * 8}
    found = replace(described, std=std, mount=replace(described.mount, errors=errors))
    (evidence,) = judge_calibration(found, payload)
    (reason,) = verdict_of([evidence]).reasons
    assert reason.kind == "calibration"
    assert words in reason.sentence
    (evidence,) = judge_calibration(replace(described, std=std), payload)
    assert verdict_of([evidence]).state == "good"


@pytest.mark.parametrize("rate", [-0.01, -5e-4, 5e-4, 0.01])
def test_clocks_that_run_apart_further_than_crystals_are_doubted(rate):
    windows = [replace(w, latency=0.004 + rate * w.time) for w in estimate().windows]
    assert kinds(estimate(windows=windows), watched()) == {"clocks"}


@pytest.mark.parametrize("rate", [-1e-4, 1e-4])
def test_clocks_that_run_apart_as_crystals_do_are_no_fault(rate):
    windows = [replace(w, latency=0.004 + rate * w.time) for w in estimate().windows]
    assert kinds(estimate(windows=windows), watched()) == set()


def test_a_plane_that_never_turns_makes_a_slice():
    watch, level = watched(), np.random.default_rng(1).uniform(-9, 9, (100, 3)) * [1, 1, 0]
    for start in (0.0, 1.0):
        watch.add(LidarBatch(level, np.full(100, start)))
    assert "slice" not in kinds(estimate(), watch), "the first returns tell a 3D lidar"
    watch = Watch()
    watch.add(LidarBatch(level, np.zeros(100)))
    assert "slice" in kinds(estimate(), watch)


def test_returns_at_one_range_are_no_surroundings():
    watch, points = Watch(), room().points
    sphere = 5.0 * points / np.linalg.norm(points, axis=1, keepdims=True)
    watch.add(LidarBatch(sphere, np.zeros(4000)))
    assert kinds(estimate(), watch) == {"even_ranges"}


@pytest.mark.parametrize("rings", [None, np.tile(np.arange(16, dtype=np.uint16), 250)])
def test_returns_without_relation_are_no_surfaces(rings):
    watch, points = Watch(), room().points
    lengths = np.random.default_rng(1).uniform(0.1, 3.0, (len(points), 1))
    watch.add(LidarBatch(lengths * points, np.zeros(4000), ring=rings))
    assert kinds(estimate(), watch) == {"scatter"}


@pytest.mark.parametrize("rings", [None, np.tile(np.arange(16, dtype=np.uint16), 250)])
def test_points_with_the_times_of_others_are_out_of_order(rings):
    watch, points = Watch(), room().points
    order = np.random.default_rng(1).permutation(len(points))
    watch.add(LidarBatch(points[order], np.zeros(4000), ring=rings))
    assert kinds(estimate(), watch) == {"point_order"}


def test_beams_in_turn_are_compared_with_themselves():
    far = 1.0 + np.arange(16) % 5
    points = np.tile(far, 250)[:, None] * np.tile([1.0, 0.2, 0.1], (4000, 1))
    for rings in (None, np.tile(np.arange(16, dtype=np.uint16), 250)):
        watch = Watch()
        watch.add(LidarBatch(points, np.zeros(4000), ring=rings))
        assert watch.returns.scatter == 0.0


def test_a_speed_that_no_carrier_has_is_named():
    found = estimate()
    fast = replace(found.trajectory, positions=100.0 * found.trajectory.positions)
    assert "speed" in kinds(replace(found, trajectory=fast), Watch())


def test_a_measure_that_is_no_number_has_failed():
    assert verdict_of([Evidence("gravity", math.nan)]).state == "failed"


@pytest.mark.parametrize(("share", "state"), [(0.99, "good"), (0.93, "doubtful"), (0.5, "failed")])
def test_what_was_seen_again_must_fit_together(share, state):
    closed = {"n_revisits": 4, "inlier_share": share, "applied": False}
    assert verdict_of(judge_closing(closed, [estimate()])).state == state


@pytest.mark.parametrize(("moved", "state"), [(0.05, "good"), (0.5, "doubtful"), (5.0, "failed")])
def test_closing_moves_a_trajectory_by_no_more_than_it_drifts(moved, state):
    closed = {"n_revisits": 4, "inlier_share": 1.0, "applied": True, "largest_translation": moved}
    assert verdict_of(judge_closing(closed, [estimate()])).state == state


def test_without_loops_nothing_is_said_of_them():
    assert judge_closing(None, []) == []
    assert judge_closing({"applied": False, "reason": "no points"}, [estimate()]) == []


@pytest.mark.parametrize(("apart", "state"), [(0.01, "good"), (0.1, "doubtful"), (0.4, "failed")])
def test_surfaces_seen_again_must_lie_together(apart, state):
    none = np.zeros(0)
    found = Revisits(apart, apart, 2 * apart, 500, none, none, none)
    assert verdict_of(judge_revisits(found, 0.02)).state == state


@pytest.mark.parametrize("outcome", ["guessed", "not found"])
def test_a_break_that_is_a_guess_is_doubtful(outcome):
    assert verdict_of(judge_breaks([Break("lidar", 3.0, 5.0, outcome)])).state == "doubtful"
    assert verdict_of(judge_breaks([Break("lidar", 3.0, 5.0, "found")])).state == "good"


def test_the_gravest_reason_decides_and_a_cause_comes_before_its_effects():
    fast = Evidence("speed", 99.0, (), {"at": 1.0})
    loose, level = Evidence("loop", 0.5), Evidence("slice", 0.97)
    found = verdict_of([fast, Evidence("gravity", 0.5), level, loose])
    assert found.state == "failed"
    assert [r.kind for r in found.reasons] == ["loop", "speed", "slice", "gravity"]
    assert [r.state for r in found.reasons] == ["failed", "failed", "doubtful", "doubtful"]
    assert found.sentence().startswith("failed: 50 % of the surfaces")
    assert "report.html has 3 more" in found.sentence()


def test_samples_that_are_plainly_wrong_are_named_before_what_follows_from_them():
    loose = Evidence("loop", 0.5)
    for period, kinds in ((0.1, ["imu_period", "loop"]), (0.04, ["loop", "imu_period"])):
        found = verdict_of([loose, Evidence("imu_period", period, (), {"rate": 1.0 / period})])
        assert found.state == "failed"
        assert [r.kind for r in found.reasons] == kinds


def test_a_verdict_comes_back_from_json():
    found = verdict_of(judge_estimate(estimate(), PAYLOAD, watched(lambda _, g, a: (-g, a))))
    assert found.reasons
    assert Verdict.from_json(plain(found)) == found


def test_evidence_comes_back_from_json():
    one = Evidence("gyro", math.inf, ((1.0, 2.0),), {"degrees": 3.0})
    assert Evidence.from_json(plain(one)) == one


def test_every_kind_says_what_to_do():
    for name, kind in KINDS.items():
        assert 0 < kind.doubtful <= kind.failed, name
        assert kind.advice, name
        assert "window" not in kind.finding + kind.advice, name


def test_nothing_is_said_too_soon():
    assert judge_so_far(None, PAYLOAD, Watch()).state == "good"
    whole = estimate()
    young = replace(whole, trajectory=whole.trajectory[:500])
    wrong = watched(lambda _, g, a: (-g, a))
    assert judge_so_far(young, PAYLOAD, wrong).state == "good"
    assert judge_so_far(whole, PAYLOAD, wrong).state == "failed"
    assert judge_so_far(whole, PAYLOAD, watched()).state == "good"


def test_units_are_told_without_an_estimate():
    verdict = judge_so_far(None, PAYLOAD, watched(lambda _, g, a: (g, a / 9.80665)))
    assert verdict.state == "failed"
    assert "the accelerations are in g" in verdict.reasons[0].sentence
