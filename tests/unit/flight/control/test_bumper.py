# SPDX-License-Identifier: MIT OR Apache-2.0
import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bentwing.base.errors import UsageError
from bentwing.flight.control import BumperSettings, CarrierState, VirtualBumper
from bentwing.flight.control.bumper import GRAVITY
from bentwing.flight.control.occupancy import GridSettings, OccupancyGrid
from bentwing.flight.control.springs import SpringSettings

SETTINGS = BumperSettings()
LIMIT = GRAVITY * math.tan(SETTINGS.max_push)
HERE = np.array([0.0, 0.0, 1.5])
ANYTHING = st.floats(allow_nan=True, allow_infinity=True)


def wall(distance, azimuth=0.0, height=1.5):
    """Points of a wall across the given direction."""
    y, z = np.meshgrid(np.arange(-3.0, 3.0, 0.05), np.arange(-0.3, 0.2, 0.05))
    points = np.column_stack([np.full(y.size, distance), y.ravel(), z.ravel() + height])
    cos, sin = math.cos(azimuth), math.sin(azimuth)
    return points @ np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])


def state(time=1.0, velocity=(0.0, 0.0, 0.0), yaw=0.0, position=HERE):
    return CarrierState(time, np.array(position), np.array(velocity), yaw)


def bumper_before(*walls, time=1.0):
    bumper = VirtualBumper()
    for points in walls:
        assert bumper.add_points(time, HERE, points)
    return bumper


def command(bumper, time=1.0, *, roll=0.0, pitch=0.0, **how):
    return bumper.command(time, state(time, **how), pilot_roll=roll, pilot_pitch=pitch)


@pytest.mark.parametrize("azimuth", np.radians([0.0, 37.0, 90.0, 200.0, 300.0]))
@pytest.mark.parametrize("yaw", [0.0, 1.0, -2.5])
def test_a_wall_pushes_away_whatever_the_heading(azimuth, yaw):
    made = command(bumper_before(wall(1.2, azimuth)), yaw=yaw)
    away = -np.array([math.cos(azimuth), math.sin(azimuth)])
    assert made.push @ away > 0.9 * np.linalg.norm(made.push) > 0.5
    # forward and left in the level frame
    tilt = GRAVITY * np.array([math.tan(made.pitch), -math.tan(made.roll)])
    flown = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]]) @ tilt
    np.testing.assert_allclose(flown, made.push, atol=1e-9)


def test_the_nearer_the_stronger_up_to_the_limit():
    pushes = [
        np.linalg.norm(command(bumper_before(wall(d))).push) for d in (2.4, 1.8, 1.4, 1.0, 0.6)
    ]
    assert all(a <= b for a, b in pairwise(pushes))
    assert pushes[0] > 0.1
    assert pushes[-1] == pytest.approx(LIMIT)


def test_beyond_the_springs_there_is_no_push():
    made = command(bumper_before(wall(3.0)), pitch=0.1)
    assert not made.push.any()
    assert made.pitch == pytest.approx(0.1)
    assert not made.faults


def test_a_thin_tree_pushes_like_a_wall():
    trunk = np.array([[1.2, 0.0, z] for z in np.arange(1.2, 1.7, 0.05)])
    one, many = command(bumper_before(trunk)), command(bumper_before(wall(1.2)))
    assert np.linalg.norm(one.push) > 0.6 * np.linalg.norm(many.push)


def test_two_walls_of_a_corridor_cancel():
    made = command(bumper_before(np.vstack([wall(1.05, np.pi / 2), wall(1.05, -np.pi / 2)])))
    assert np.linalg.norm(made.push) < 0.25


def test_the_stick_into_the_wall_fades_and_along_it_stays():
    bumper = bumper_before(wall(0.65))
    into, away = command(bumper, pitch=0.2), command(bumper, pitch=-0.2)
    assert into.pitch == pytest.approx(-SETTINGS.max_push, abs=1e-6)
    assert away.pitch < into.pitch
    assert command(bumper, roll=0.1).roll > 0.05


def test_approaching_pushes_harder_than_standing():
    bumper = bumper_before(wall(2.0))
    standing, flying = command(bumper), command(bumper, velocity=(1.0, 0.0, 0.0))
    assert np.linalg.norm(flying.push) > 1.2 * np.linalg.norm(standing.push)
    leaving = command(bumper, velocity=(-1.0, 0.0, 0.0))
    np.testing.assert_allclose(leaving.push, standing.push)


@settings(max_examples=60, deadline=None)
@given(roll=ANYTHING, pitch=ANYTHING, speed=st.floats(-19.0, 19.0), distance=st.floats(0.1, 3.0))
def test_no_input_exceeds_the_limits(roll, pitch, speed, distance):
    made = command(
        bumper_before(wall(distance)), roll=roll, pitch=pitch, velocity=(speed, 0.0, 0.0)
    )
    assert np.linalg.norm(made.push) <= LIMIT + 1e-9
    assert max(abs(made.roll), abs(made.pitch)) <= SETTINGS.max_tilt + 1e-9


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [
        ({"position": np.array([np.nan, 0.0, 0.0])}, "not finite"),
        ({"velocity": np.array([np.inf, 0.0, 0.0])}, "not finite"),
        ({"velocity": np.array([50.0, 0.0, 0.0])}, "speed"),
        ({"yaw": math.nan}, "yaw"),
        ({"time": 0.2}, "old"),
        ({"time": 1.5}, "future"),
        ({"time": math.nan}, "no finite time"),
    ],
)
def test_a_state_that_cannot_be_used_gives_no_push_and_the_pilot_flies(wrong, reason):
    values = {"time": 1.0, "position": HERE, "velocity": np.zeros(3), "yaw": 0.0} | wrong
    made = bumper_before(wall(0.7)).command(
        1.0, CarrierState(**values), pilot_roll=0.1, pilot_pitch=0.2
    )
    assert reason in made.faults[0]
    assert (made.roll, made.pitch) == (0.1, 0.2)
    assert not made.push.any()


def test_without_fresh_points_there_is_no_push_and_it_says_so():
    assert "no points yet" in command(VirtualBumper()).faults[0]
    assert "old: no push" in command(bumper_before(wall(0.7)), time=2.0).faults[0]


def test_a_jump_of_the_position_clears_the_map():
    bumper = bumper_before(wall(0.7))
    command(bumper)
    made = command(bumper, position=[5.0, 0.0, 1.5])
    assert "jumped by 5.00 m" in made.faults[0]
    assert not len(bumper.grid.occupied(1.0))


def test_points_that_cannot_be_used_are_refused_and_counted():
    bumper = bumper_before(wall(1.0))
    assert not bumper.add_points(0.5, HERE, wall(1.0))
    assert not bumper.add_points(math.nan, HERE, wall(1.0))
    assert not bumper.add_points(1.1, [np.nan, 0.0, 0.0], wall(1.0))
    assert not bumper.add_points(1.1, HERE, np.full((3, 3), np.nan))
    assert bumper.refused == {"scans": 3, "points": 3}
    with pytest.raises(ValueError, match=r"shape \(N, 3\)"):
        bumper.add_points(1.2, HERE, np.zeros(3))
    with pytest.raises(ValueError, match="origin"):
        bumper.add_points(1.2, [0.0], wall(1.0))


def test_the_same_points_give_the_same_command():
    first, second = (command(bumper_before(wall(1.0), wall(1.4, 2.0)), pitch=0.1) for _ in "ab")
    assert (first.roll, first.pitch) == (second.roll, second.pitch)


def test_a_ray_frees_what_was_occupied():
    grid = OccupancyGrid(GridSettings())
    post = np.array([[1.05, 0.05, 1.5]])
    grid.add(0.0, HERE, post)
    assert len(grid.occupied(0.0)) == 1
    for k in range(1, 6):
        grid.add(0.02 * k, HERE, np.array([[2.55, 0.1, 1.5]]))
    assert not (np.abs(grid.occupied(0.1) - post[0, :2]).max(axis=1) < 0.06).any()
    assert (np.abs(grid.free(0.1) - [0.55, 0.05]).max(axis=1) < 0.06).any()


def test_evidence_outlasts_half_a_turn_and_is_then_forgotten():
    grid = OccupancyGrid(GridSettings(half_turn=0.8))
    grid.add(0.0, HERE, wall(1.0))
    assert len(grid.occupied(0.9))
    assert not len(grid.occupied(2.5))


def test_the_grid_follows_the_carrier_and_keeps_places():
    grid = OccupancyGrid(GridSettings())
    grid.add(0.0, HERE, wall(1.0))
    before = grid.occupied(0.0)
    grid.add(0.0, HERE + np.array([-0.35, 0.52, 0.13]), np.array([[-3.0, 0.5, 1.6]]))
    kept = {tuple(np.round(c, 6)) for c in grid.occupied(0.0)}
    assert {tuple(np.round(c, 6)) for c in before} <= kept
    grid.add(0.0, HERE + 100.0, wall(1.0) + 100.0)
    assert (grid.occupied(0.0) > 90.0).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"max_push": math.nan},
        {"max_push": 0.5, "max_tilt": 0.4},
        {"springs": SpringSettings(length=5.0)},
        {"hull_radius": 0.0},
    ],
)
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(UsageError):
        BumperSettings(**wrong)
