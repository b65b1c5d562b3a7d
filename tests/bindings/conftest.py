# SPDX-License-Identifier: MIT OR Apache-2.0
"""One of everything the core takes: a spinning scanner that flies through a room."""

from __future__ import annotations

import functools
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import _core
from bentwing.base import geometry
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.settings import RegistrationSettings, SurfelSettings
from bentwing.odometry.continuous.slow_states import N_STATES
from bentwing.recording import Payload

DT, RATE_HZ, SPIN = 0.01, 200.0, 5.0  # s, Hz, rad/s
BASE = ((0.05, 0.0, -0.03), (0.0, 0.0, 0.0, 1.0))
UP = np.array([0.0, 0.0, 9.80665])  # m/s²
INFORMATION = np.diag(
    np.repeat(
        [1e4, 1e5, 4e8, 1e4, 4e4, 1e4, 1e7, 6e2, 2.5e3, 1e4], [15, 1, 1, 3, 3, 2, 3, 3, 2, 24]
    )
)


def make_globals(base=BASE, **changed):
    values = {
        "latency": 0.0,
        "gyro_bias": (0.0, 0.0, 0.0),
        "accel_bias": (0.0, 0.0, 0.0),
        "gravity": (0.0, 0.0, 9.80665),
    }
    return _core.Globals(base, **{**values, **changed})


def make_room():
    """A scene: the inside of a box of 8 x 6 x 4 m, cut into two by a wall that leaves a door."""
    corners = np.array([[x, y, z] for x in (-4, 4) for y in (-3, 3) for z in (-1, 3)], float)
    wall = np.array([[1, y, z] for y in (-3, 0.5) for z in (-1, 3)], float)
    box = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    quads = [*box, [8, 9, 11, 10]]
    triangles = [t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]
    return _core.Scene(np.vstack([corners, wall]), np.array(triangles, np.uint32))


def pose(times):
    """Positions (N, 3), velocities' derivative by formula, and quaternions (N, 4)."""
    w = 0.7
    positions = np.stack([np.sin(w * times) - 1.5, 0.8 * np.cos(w * times), 0.2 * times], axis=1)
    accel = np.stack([np.sin(w * times), 0.8 * np.cos(w * times), 0 * times], axis=1) * -(w**2)
    quats = geometry.exp(np.stack([0 * times, 0 * times, SPIN * times], axis=1))
    return positions, accel, quats


@functools.cache
def flown(duration=2.5, noise=0.01):
    """Return what a scan of the room gives: samples, points, stamps, inertial data."""
    rng = np.random.default_rng(0)
    times = np.arange(0.0, duration + 0.06, DT)
    positions, _, quats = pose(times)
    stamps = np.arange(0.0, duration, 1 / 20_000)
    p, _, q = pose(stamps)
    angles = 2 * np.pi * 40.0 * stamps
    beams = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    origins = p + geometry.rotate(q, np.tile(BASE[0], (len(p), 1)))
    ranges, _ = make_room().cast(origins, np.ascontiguousarray(geometry.rotate(q, beams)), 30.0)
    points = beams * (ranges + rng.normal(0.0, noise, len(ranges)))[:, None]
    imu_times = np.arange(-0.2, duration + 0.3, 1 / RATE_HZ)
    _, accel, turned = pose(imu_times)
    force = geometry.rotate(geometry.inverse(turned), accel + UP)
    gyro = np.tile([0.0, 0.0, SPIN], (len(imu_times), 1))
    return SimpleNamespace(
        positions=positions,
        quats=quats,
        points=np.ascontiguousarray(points),
        stamps=stamps,
        imu=(imu_times, gyro, np.ascontiguousarray(force)),
    )


@pytest.fixture(scope="session")
def room():
    return make_room()


@pytest.fixture(scope="session")
def flight():
    return flown()


@pytest.fixture(scope="session")
def states():
    """Make the slow states; keyword arguments replace single ones."""
    return make_globals


@pytest.fixture(scope="session")
def samples(flight):
    return _core.Samples(0.0, DT, flight.positions, flight.quats)


@pytest.fixture(scope="session")
def drifted(flight):
    """Samples that drift by 3 cm and a third of a degree over the flight."""
    n = len(flight.positions)
    share = np.linspace(0.0, 1.0, n)[:, None]
    turn = geometry.exp(share * [0.0, 0.0, 0.006])
    return _core.Samples(
        0.0,
        DT,
        flight.positions + share * [0.03, -0.01, 0.02],
        geometry.multiply(turn, flight.quats),
    )


@pytest.fixture(scope="session")
def extract(flight, samples):
    """Extract surfels from the flight; keyword arguments replace single ones."""

    def call(**changed):
        values = {
            "points": flight.points,
            "stamps": flight.stamps,
            "angles": None,
            "samples": samples,
            "globals": make_globals(),
            "settings": SurfelSettings(),
            "range_sigma": 0.01,
        }
        return _core.extract_surfels(**{**values, **changed})

    return call


@pytest.fixture(scope="session")
def register(flight, drifted, extract):
    """Register the drifted flight; keyword arguments replace single ones."""
    surfels = extract(samples=drifted)
    core = CoreSettings.of(RegistrationSettings(), Payload.default(), DT)

    def call(**changed):
        values = {
            "samples": drifted,
            "surfels": [surfels],
            "views": [],
            "imu": _core.Imu(*flight.imu),
            "globals": make_globals(),
            "information": INFORMATION,
            "offset": [0.0] * N_STATES,
            "frozen": [True] * 15 + [False, True] + [False] * 6 + [True] * 2 + [False] * 32,
            "joined": False,
            "settings": core,
        }
        return _core.register_window(**{**values, **changed})

    return call
