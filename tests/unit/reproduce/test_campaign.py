# SPDX-License-Identifier: MIT OR Apache-2.0
"""Trials on short recordings, and what is made of their results."""

import time

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.progress import LineProgress
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.trajectory import angles
from bentwing.odometry.kalman import KalmanSettings
from bentwing.reproduce import fu2023, tazir2020
from bentwing.reproduce.campaign import (
    Job,
    Result,
    as_a_whole,
    fly,
    gather,
    steps,
    with_first_pose,
)
from bentwing.reproduce.figure import Assignment, TextTable
from bentwing.reproduce.tazir_measures import measure
from bentwing.reproduce.tazir_walls import WALLS, scan_walls
from bentwing.reproduce.trials import Flight, Trial

NO_POINTS = np.zeros((0, 3), np.float32)


@pytest.fixture(scope="module")
def hover(tmp_path_factory):
    """Four seconds over the town, where the filter gives up for want of a rest and ndt does not."""
    trials = (Trial("ndt", "ndt"), Trial("kalman", "kalman", KalmanSettings(rehearsal=0.0)))
    scenario = {"scene": "town", "flight": "survey", "calibrated": True, "motor_rate": 1.0}
    shown = []
    flight = Flight("hover", scenario, 4.0, 4.0, trials)
    flown = fly(tmp_path_factory.mktemp("hover"), shown.append, flight, 4.0, 5)
    return flown, shown


def test_a_flight_comes_with_its_results_placed_on_the_truth(hover):
    flown, shown = hover
    found = flown.results["ndt"]
    assert found.rmse < 0.15
    there = found.aligned.covers(flown.truth.times)
    positions, quats = found.aligned.interpolate(flown.truth.times[there])
    assert np.linalg.norm(positions - flown.truth.positions[there], axis=1).max() < 0.3
    assert np.degrees(angles(quats, flown.truth.quats_xyzw[there])).max() < 1.0
    assert 1.5 < flown.way[-1] < 3.0  # two seconds of hovering, two at 1 m/s
    # Simulated once and estimated twice.
    assert sum(shown) == pytest.approx(12.0, abs=0.5)


def test_points_by_true_poses_agree_with_those_of_the_estimate_and_need_the_motor(hover):
    flown, _ = hover
    found = flown.results["ndt"].points
    assert len(found) == len(flown.true_points) == len(flown.unturned_points) > 1e5
    assert np.median(np.linalg.norm(found - flown.true_points, axis=1)) < 0.3
    assert np.median(np.linalg.norm(flown.unturned_points - flown.true_points, axis=1)) > 3.0


def test_errors_are_those_of_the_paper(hover):
    flown, _ = hover
    found = measure(flown, flown.results["ndt"])
    assert found.errors.rte[0] == pytest.approx(0.0, abs=1e-9)
    assert found.lost_after is None
    assert found.registration.shape[1] == 2
    assert 0.01 < found.registration[:, 1].mean() < 0.15


def test_an_estimate_of_a_straight_way_is_moved_onto_the_truth():
    times = 0.01 * np.arange(200)
    positions = np.stack([times, 0 * times, 0 * times], axis=1)
    truth = Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (200, 1)))
    turn = geometry.exp(np.array([0.3, -0.2, 1.9]))
    moved = Trajectory(
        times,
        geometry.rotate(turn, positions) + np.array([5.0, 1.0, -2.0]),
        geometry.multiply(turn, truth.quats_xyzw),
    )
    for back in (with_first_pose(moved, truth), as_a_whole(moved, truth)):
        np.testing.assert_allclose(back.positions, positions, atol=1e-9)
        np.testing.assert_allclose(angles(back.quats_xyzw, truth.quats_xyzw), 0.0, atol=1e-7)


def test_where_the_way_turns_a_wrong_mount_does_not_turn_the_estimate():
    times = 0.01 * np.arange(300)
    positions = np.stack([np.cos(times), np.sin(times), 0.1 * times], axis=1)
    truth = Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1)))
    mount = geometry.exp(np.array([0.02, 0.0, 0.01]))
    tilted = Trajectory(times, positions, geometry.multiply(truth.quats_xyzw, mount))
    np.testing.assert_allclose(as_a_whole(tilted, truth).positions, positions, atol=1e-9)


def result(distances):
    none = np.array(distances, np.float64)
    return Result(None, None, None, none, none, NO_POINTS, "", [], 1.0, 1.0, 1.0)


def test_what_gave_up_or_left_the_way_is_lost():
    assert result([]).lost
    assert result([3.0, 2.5]).lost
    assert not result([0.1, 0.2]).lost


def add(folder, advance, x):
    folder.mkdir()
    time.sleep(0.05)
    advance(x)
    return x + 1


def refuse(_folder, _advance, why):
    raise ValueError(why)


def test_jobs_are_done_in_processes_and_their_failure_is_raised(tmp_path, capsys):
    jobs = [Job(f"job {x}", float(x), add, (x,)) for x in (1, 5, 3)]
    found = gather(jobs, Assignment(tmp_path, progress=LineProgress()))
    assert found == {"job 1": 2, "job 5": 6, "job 3": 4}
    assert "fly and map: done" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
    with pytest.raises(ValueError, match="no wind"):
        gather([Job("bad", 1.0, refuse, ("no wind",))], Assignment(tmp_path))


def test_steps_add_up():
    shown = []
    at = steps(shown.append)
    for place in (1.0, 1.5, 4.0):
        at(place)
    assert shown == [1.0, 0.5, 2.5]


def test_a_fixed_lidar_sees_a_band_of_the_walls_and_no_floor(tmp_path):
    covered = scan_walls(tmp_path / "walls", lambda _: None, WALLS[0], 1.0, 2)
    for columns, reach in ((slice(38, 42), 2.68), (slice(0, 1), 3.79)):
        # 15° up and down from 5 m above the floor, 10 m away, and √2 times as far in the corner.
        cells = 0.25 * np.flatnonzero(covered.along[columns].any(axis=0))
        assert cells.min() == pytest.approx(5.0 - reach, abs=0.3)
        assert cells.max() + 0.25 == pytest.approx(5.0 + reach, abs=0.3)
    assert not covered.floor.any()


def test_flights_have_names_of_their_own_and_shorter_ones_when_in_a_hurry():
    for flights in (fu2023.FLIGHTS, (*tazir2020.FLIGHTS, *WALLS)):
        assert len({f.name for f in flights}) == len(flights)
        assert all(f.seconds(quick=True) < f.seconds(quick=False) for f in flights)


def test_a_table_reads_as_markdown():
    table = TextTable("T", ("a", "b"), [("1", "2")], "note")
    assert table.markdown() == "**T**\n\n| a | b |\n|---|---|\n| 1 | 2 |\n\nnote\n"
