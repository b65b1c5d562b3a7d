# SPDX-License-Identifier: MIT OR Apache-2.0
"""The mount of a 2D lidar from where its scans cross, in a room that is known exactly."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bentwing.calibrate.set_up.crossings import Crossings, Reading
from bentwing.calibrate.set_up.delays import likely_delays
from bentwing.calibrate.set_up.rotations import spread
from bentwing.calibrate.set_up.scans import Scans
from bentwing.recording.batches import ImuBatch, LidarBatch

MOUNT = Rotation.from_euler("xyz", [20, -35, 110], degrees=True).as_matrix()
HALF_TURN = np.diag([-1.0, -1.0, 1.0])
LOW, HIGH = np.array([-3.0, -7.0, -1.2]), np.array([5.0, 4.0, 2.1])
LENGTH, SCAN, N_BEAMS = 8.0, 0.025, 360


def attitude(t: np.ndarray) -> Rotation:
    """A head that nods and is turned about by hand."""
    return Rotation.from_euler(
        "zyx", np.column_stack([0.7 * np.sin(0.9 * t), 0.8 * np.sin(5 * t), 0.4 * np.cos(2 * t)])
    )


def room(directions: np.ndarray) -> np.ndarray:
    """Ranges (N,) from the origin to the walls of a box."""
    with np.errstate(divide="ignore"):
        ahead = np.where(directions > 0, HIGH / directions, LOW / directions)
    return ahead.min(axis=1)


def sphere(directions: np.ndarray) -> np.ndarray:
    return np.full(len(directions), 4.0)


def nodded(t: np.ndarray) -> Rotation:
    """A head that nods, ever faster, on a carrier that hardly turns."""
    nod = 0.8 * np.sin(5 * t + 0.05 * t**2)
    return Rotation.from_euler("zyx", np.column_stack([0.02 * t, nod, 0.1 * np.sin(t)]))


def spun(t: np.ndarray) -> Rotation:
    """A head that spins evenly about the vertical and hardly tilts."""
    return Rotation.from_euler(
        "zyx", np.column_stack([4.0 * t, 0.02 * np.sin(0.7 * t), 0.02 * np.cos(0.9 * t)])
    )


def flight(surroundings, attitude=attitude, length=LENGTH) -> tuple[Scans, ImuBatch]:
    """Scans of a head that turns on the spot, and its inertial samples."""
    times = np.arange(0, length, SCAN / N_BEAMS)
    azimuths = np.tile(np.linspace(-2.3, 2.3, N_BEAMS), len(times) // N_BEAMS)
    times = times[: len(azimuths)]
    beams = np.column_stack([np.cos(azimuths), np.sin(azimuths), np.zeros(len(azimuths))])
    points = surroundings(attitude(times).apply(beams @ MOUNT.T))[:, None] * beams
    at, step = np.arange(0, length, 0.005), 1e-4
    turns = attitude(at - step).inv() * attitude(at + step)
    gyro = turns.as_rotvec() / (2 * step)
    return Scans(LidarBatch(points, times)), ImuBatch(at, gyro, np.zeros_like(gyro))


@pytest.fixture(scope="module")
def in_a_room() -> tuple[Scans, ImuBatch]:
    return flight(room)


def angle(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.degrees(Rotation.from_matrix(a.T @ b).magnitude()))


def test_the_mount_and_its_mirror_image_fit_best(in_a_room):
    best, second = (R for _, R in Crossings(*in_a_room).mounts(Reading())[:2])
    either = sorted([angle(best, MOUNT), angle(best, MOUNT @ HALF_TURN)])
    other = sorted([angle(second, MOUNT), angle(second, MOUNT @ HALF_TURN)])
    assert either[0] < 3.0
    assert other[0] < 3.0
    assert angle(best, second) > 170.0


def test_a_gyro_that_turns_the_other_way_shows(in_a_room):
    scans, imu = in_a_room
    negated = Crossings(scans, ImuBatch(imu.times, -imu.gyro, imu.accel))
    assert negated.least(Reading(hand=-1)) < 0.5 * negated.least(Reading(hand=1))
    assert negated.misfit(MOUNT, Reading(hand=-1)) == pytest.approx(
        Crossings(scans, imu).misfit(MOUNT, Reading()), abs=1e-3
    )


@pytest.mark.parametrize("delay", [-0.8, 0.3])
def test_a_delay_shows(in_a_room, delay):
    scans, imu = in_a_room
    crossings = Crossings(scans, ImuBatch(imu.times - delay, imu.gyro, imu.accel))
    assert crossings.misfit(MOUNT, Reading(delay)) < 0.4 * crossings.misfit(MOUNT, Reading())


def test_a_delay_that_shows_is_the_likeliest():
    scans, imu = flight(room, nodded, length=12.0)
    late = ImuBatch(imu.times + 0.8, imu.gyro, imu.accel)
    found = likely_delays(scans, late, Crossings(scans, late))
    assert found[0] == pytest.approx(-0.8, abs=0.03)
    assert found[1] == pytest.approx(0.0, abs=0.15)


def test_of_a_head_that_spins_evenly_the_clocks_are_believed_and_all_mounts_are_covered():
    scans, imu = flight(room, spun)
    crossings = Crossings(scans, imu)
    assert likely_delays(scans, imu, crossings)[0] == pytest.approx(0.0, abs=0.06)
    # A trial corrects a mount by 20°.
    mounts = [R for _, R in crossings.mounts(Reading())]
    assert min(min(angle(R, MOUNT), angle(R, MOUNT @ HALF_TURN)) for R in mounts) < 20.0


def test_no_mount_is_better_than_another_where_all_looks_alike():
    crossings = Crossings(*flight(sphere))
    assert crossings.usual - crossings.least(Reading()) < 1e-3


@pytest.mark.parametrize("n", [250, 1000])
def test_rotations_are_spread_evenly(n):
    # A ball of radius r holds r³ / 6π of all rotations; balls that cover them all overlap.
    turned = Rotation.from_matrix(spread(n))
    nearest = [
        float((turned.inv() * Rotation.random(random_state=seed)).magnitude().min())
        for seed in range(100)
    ]
    assert max(nearest) < 1.5 * (6 * np.pi / n) ** (1 / 3)
