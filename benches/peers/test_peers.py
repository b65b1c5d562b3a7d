# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the comparison with other engines does to points, stamps and results; needs none of them."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benches.peers import attitude, runner, scans, stamps, table
from benches.peers.engines import ENGINES, Engine
from benches.peers.feed import Head, Imu, open_feed, write_feed
from benches.support.cost import Cost, Finished, python
from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.recording import Encoder


def circling(times):
    """Once around in 10 s on a circle of 2 m, looking ahead, with a roll of its own."""
    angle = 0.2 * np.pi * times
    positions = np.stack([2 * np.cos(angle), 2 * np.sin(angle), 0.1 * times], axis=1)
    yaw = geometry.exp(np.stack([0 * angle, 0 * angle, angle], axis=1))
    roll = geometry.exp(np.stack([0.3 * np.sin(3 * times), 0 * times, 0 * times], axis=1))
    return Trajectory(times, positions, geometry.multiply(yaw, roll))


def rates_of(trajectory):
    steps = geometry.multiply(
        geometry.inverse(trajectory.quats_xyzw[:-1]), trajectory.quats_xyzw[1:]
    )
    rates = geometry.log(steps) / np.diff(trajectory.times)[:, None]
    return np.vstack([rates[:1], 0.5 * (rates[1:] + rates[:-1]), rates[-1:]])


def head(**changed):
    starts = [0, 100_000_000, 200_000_000, 300_000_000]
    values = {
        "kind": "sweeps",
        "T_body_lidar": np.eye(4).tolist(),
        "rows": 2,
        "columns": 4,
        "period": 0.1,
        "min_range": 0.5,
        "max_range": 50.0,
        "starts_ns": starts,
        "ends_ns": [start + 100_000_000 for start in starts],
    }
    return Head(**{**values, **changed})


def test_a_cut_gives_every_point_after_the_first_start_to_one_scan() -> None:
    times = np.linspace(0.0, 1.0, 101)
    parts = scans.cut(times, np.array([0.195, 0.5, 0.55, 2.0]))
    assert [len(times[part]) for part in parts] == [30, 5, 46]
    assert times[parts[0]][0] == 0.2
    assert parts[0].stop == parts[1].start


def test_a_scan_that_waited_too_long_keeps_its_last_points() -> None:
    times = np.linspace(0.0, 10.0, 101)
    (part,) = scans.cut(times, np.array([0.0]), longest=1.5)
    assert times[part][0] == pytest.approx(8.5)
    assert times[part][-1] == 10.0


def test_half_turns_begin_every_half_turn_whatever_the_axis_and_the_direction() -> None:
    times = np.linspace(0.0, 10.0, 2001)
    axis = np.array([0.0, -0.6, 0.8])
    rates = -4.0 * np.tile(axis, (len(times), 1))
    starts = scans.half_turns(times, rates)
    np.testing.assert_allclose(np.diff(starts), np.pi / 4.0, atol=0.006)


def test_a_nodding_head_completes_its_half_turns_by_going_to_and_fro() -> None:
    times = np.linspace(0.0, 4.0, 801)
    rates = np.zeros((len(times), 3))
    rates[:, 1] = np.pi * np.sign(np.sin(2 * np.pi * times + 1e-9))
    assert np.diff(scans.half_turns(times, rates)) == pytest.approx(1.0, abs=0.02)


def test_points_by_encoder_stand_still_while_the_motor_turns() -> None:
    encoder = Encoder.model_validate(
        {
            "axis": [0.0, 0.0, 1.0],
            "T_imu_motor": {"translation": [0.1, 0.0, -0.1]},
            "T_motor_lidar": {
                "translation": [0.0, 0.02, 0.0],
                "quaternion": [0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)],
            },
        }
    )
    target, angles = np.array([3.0, -1.0, 0.5]), np.linspace(0.0, 6.0, 50)
    lidar = [
        np.linalg.inv(_mount(encoder, angle)) @ np.append(target, 1.0) for angle in angles.tolist()
    ]
    found = scans.by_encoder(np.array(lidar)[:, :3], angles, encoder)
    np.testing.assert_allclose(found, np.tile(target, (50, 1)), atol=1e-12)


def _mount(encoder, angle):
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    return encoder.T_imu_motor.pose.matrix @ turn @ encoder.T_motor_lidar.pose.matrix


def test_an_organised_sweep_has_a_place_for_every_shot() -> None:
    step = 55.296e-6
    table_ = np.zeros(6, scans.POINT)
    table_["x"] = np.arange(1, 7)
    table_["ring"] = [0, 1, 0, 1, 0, 1]
    # The second beam fires a little after the first; nanoseconds are rounded.
    table_["t"] = np.rint(1e9 * (step * np.array([0, 0, 1, 1, 3, 3]) + 34e-6 * table_["ring"]))
    image = scans.organised(table_, (2, 4), scans.column_by_time(table_, step)).reshape(2, 4)
    np.testing.assert_array_equal(image["x"], [[1, 3, 0, 5], [2, 4, 0, 6]])
    np.testing.assert_array_equal(image["ring"], [[0] * 4, [1] * 4])


def test_where_shots_without_return_are_not_known_the_order_in_a_ring_counts() -> None:
    table_ = np.zeros(5, scans.POINT)
    table_["x"] = np.arange(1, 6)
    table_["ring"] = [1, 0, 1, 1, 0]
    image = scans.organised(table_, (2, 3), scans.column_by_order(table_)).reshape(2, 3)
    np.testing.assert_array_equal(image["x"], [[2, 5, 0], [1, 3, 4]])


def test_the_attitude_by_the_gyro_is_that_of_the_motion() -> None:
    times = np.linspace(0.0, 10.0, 2001)
    truth = circling(times)
    bias = np.array([0.01, -0.02, 0.005])
    found = attitude.integrated(times, rates_of(truth) + bias, bias)
    turned = geometry.multiply(geometry.inverse(truth.quats_xyzw[:1]), truth.quats_xyzw)
    error = geometry.log(geometry.multiply(geometry.inverse(turned), found))
    assert np.abs(error).max() < 1e-3


def test_poses_between_sparse_ones_follow_the_gyro_and_a_cubic() -> None:
    times = np.linspace(0.0, 10.0, 2001)
    truth = circling(times)
    drifting = attitude.integrated(times, rates_of(truth), np.full(3, 0.01))
    sparse = Trajectory(times[::100], truth.positions[::100], truth.quats_xyzw[::100])
    dense = attitude.densified(sparse, attitude.as_trajectory(times, drifting))
    np.testing.assert_allclose(dense.times, times)
    turns = geometry.multiply(geometry.inverse(truth.quats_xyzw), dense.quats_xyzw)
    assert np.abs(geometry.log(turns)).max() < 1e-3
    # Hermite's cubic over 0.5 s: h^4/384 of the fourth derivative, and h^3/36 at most by its
    # velocities, which at the ends are of one side and h/8 of half the acceleration step.
    errors = np.linalg.norm(dense.positions - truth.positions, axis=1)
    assert errors[200:-200].max() < 0.5**3 / 36 * 2 * (0.2 * np.pi) ** 3
    assert errors.max() < 0.5**2 / 8 * 2 * (0.2 * np.pi) ** 2


@pytest.mark.parametrize(
    ("scan", "share", "expected"),
    [(0, 0.0, [100, 200]), (0, 0.5, [150, 250]), (0, 1.0, [200, 300]), (-1, 0.5, [50, 150])],
)
def test_a_pose_is_put_where_its_engine_means_it(scan, share, expected) -> None:
    engine = Engine("any", pose_scan=scan, pose_share=share)
    found = stamps.pose_stamps(np.array([101, 199]) * 1_000_000, head(), engine)
    np.testing.assert_array_equal(found, np.array(expected) * 1_000_000)


def test_a_shifted_clock_is_found() -> None:
    # Unlike a circle, where it goes shows when.
    times = np.linspace(0.0, 10.0, 2001)
    positions = np.stack([np.sin(times), np.cos(1.7 * times), 0.1 * times**2], axis=1)
    truth = Trajectory(times, positions, circling(times).quats_xyzw)
    sparse = truth.times[200:1800:20]
    late = Trajectory(sparse + 0.0437, *truth.interpolate(sparse))
    shift, error = stamps.best_shift(late, truth, (0.0, 10.0))
    assert shift == pytest.approx(-0.0437, abs=2e-4)
    assert error < 1e-3


def test_a_feed_is_read_as_it_was_written_and_scans_come_once_they_are_known(tmp_path) -> None:
    sweep = np.zeros(3, scans.POINT)
    sweep["x"] = [1, 2, 3]
    n = 50
    values = (np.zeros((n, 3)), np.ones((n, 3)), np.zeros((n, 4)), np.zeros((n, 4)))
    imu = Imu(np.arange(n) * 10_000_000, *values)
    write_feed(tmp_path, head(), imu, [sweep, sweep[:2], sweep, sweep])
    feed = open_feed(tmp_path)
    assert feed.head == head()
    assert [len(scan) for scan in feed.scans()] == [3, 2, 3, 3]
    events = list(feed.events())
    assert [i for kind, i in events if kind == "imu"] == list(range(n))
    assert [i for kind, i in events if kind == "scan"] == [0, 1, 2, 3]
    before = events[: events.index(("scan", 1))]
    # The end of that scan, and one sample after it.
    assert max(i for kind, i in before if kind == "imu") == 20


def result(**changed):
    return {
        "recording": "court",
        "engine": "any",
        "duration": 40.0,
        "threads": "1",
        "cost": {"seconds": 20.0, "cpu": 10.0, "megabytes": 123.4},
        "failure": None,
        "score": {
            "ate": 0.0123,
            "ate_flight": 0.01,
            "rotation": np.radians(0.5),
            "horizontal": None,
            "vertical": 0.002,
            "map_ratio": 1.5,
        },
        **changed,
    }


def test_a_row_has_every_number_in_its_unit() -> None:
    assert table.row(result()) == (
        "| court | any | 1.23 cm | 1.00 cm | 0.50 ° | -, 2.00 mm/m | 1.50 | 0.25 s | 0.50 s "
        "| 123 MB | 1 |"
    )
    assert len(table.COLUMNS) == table.row(result()).count("|") - 1


def test_a_failed_engine_keeps_its_row() -> None:
    row = table.row(result(failure="crashed: SIGSEGV", score={}))
    assert row.startswith("| court | any | crashed: SIGSEGV | - |")
    assert row.count("|") - 1 == len(table.COLUMNS)
    refused = table.row(result(failure="needs rings", score={}, cost=None))
    assert refused.count("|") - 1 == len(table.COLUMNS)


def test_the_middle_of_rounds_is_that_of_their_cost_and_of_their_error() -> None:
    rounds = [
        result(cost={"seconds": s, "cpu": s / 2, "megabytes": 100.0}, score={"ate_flight": error})
        for s, error in ((9.0, 0.1), (1.0, 0.3), (4.0, 0.2))
    ]
    found = table.middle(rounds)
    assert found["cost"] == {"seconds": 4.0, "cpu": 2.0, "megabytes": 100.0}
    assert found["score"] == {"ate_flight": 0.2}
    lost = result(failure="lost", score={})
    assert table.middle([rounds[0], lost, lost])["failure"] == "lost"


@pytest.mark.parametrize(
    ("finished", "outcome", "expected"),
    [
        (Finished(Cost(1, 1, 1), 0), {}, None),
        (Finished(Cost(1, 1, 1), -11), {}, "crashed: SIGSEGV"),
        (Finished(Cost(9, 1, 1), -9, timed_out=True), {}, "timed out after 9 s"),
        (Finished(Cost(1, 1, 1), 1), {"failure": "crashed: bad | worse"}, "crashed: bad / worse"),
        (Finished(Cost(1, 1, 1), 3), {}, "crashed: no such file"),
    ],
)
def test_an_end_is_told_in_a_few_words(tmp_path, finished, outcome, expected) -> None:
    log = tmp_path / "log.txt"
    log.write_text("reading\nno such file\n\n")
    assert runner.failure_of(finished, outcome, log, 9.0) == expected


def test_engines_are_not_given_what_they_cannot_take() -> None:
    def fed(kind, rows=1, *, imu=True):
        return SimpleNamespace(head=head(kind=kind, rows=rows), imu=imu or None)

    assert runner.unfit(ENGINES["lio-sam"], fed("joined")) == "needs rings"
    assert runner.unfit(ENGINES["lio-sam"], fed("sweeps", rows=16)) is None
    assert runner.unfit(ENGINES["rko-lio"], fed("sweeps", imu=False)) == "needs an IMU"
    assert runner.unfit(ENGINES["kiss-icp"], fed("stabilized")) is None


def test_a_command_is_killed_when_its_time_is_over(tmp_path) -> None:
    finished = python("-c", "import time; time.sleep(60)", timeout=0.5, output=tmp_path / "log")
    assert finished.timed_out
    assert finished.code == -9
    assert finished.cost.seconds < 30


def test_what_a_command_prints_and_how_it_ends_is_known(tmp_path) -> None:
    log = tmp_path / "log"
    finished = python("-c", "print('said'); raise SystemExit(3)", timeout=60, output=log)
    assert (finished.code, finished.timed_out, log.read_text()) == (3, False, "said\n")
