# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar turned by a motor in a box-shaped room, exact but for the noise that is asked for."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.mount import Pose
from bentwing.calibrate.motor_mount import turned
from bentwing.calibrate.revolution import Revolutions, Stretch

AXIS = np.array([0.0, 0.0, 1.0])
NOMINAL = Pose(np.array([0.0, 0.0, -0.07]), np.array([0.0, np.sqrt(0.5), 0.0, np.sqrt(0.5)]))
LOW, HIGH = np.array([-3.0, -4.0, -1.2]), np.array([5.0, 2.5, 1.8])
SWEEP = 0.1  # s


def perturbed(rotation, shift):
    """The nominal place of the lidar, turned (motor frame, rad) and shifted (m)."""
    quat = geometry.multiply(geometry.exp(np.asarray(rotation)), NOMINAL.quaternion)
    return Pose(NOMINAL.translation + shift, quat)


def revolution(true, *, rate=2.0, n_turns=1, n=40_000, sigma=0.0, delay=0.0, seed=0):
    """What a 16-beam lidar at `true` sees; `rate` may be two rates, one after the other."""
    rng = np.random.default_rng(seed)
    rates = np.atleast_1d(np.asarray(rate, dtype=float))
    length = n_turns * 2 * np.pi / np.abs(rates)
    parts, begin = [], 0.3
    for speed, duration in zip(rates, length, strict=True):
        since = np.sort(rng.uniform(0.0, duration, n))
        parts.append((since, begin + speed * since, np.full(n, speed)))
        begin += speed * duration
    times = np.concatenate([s + sum(length[:i]) for i, (s, _, _) in enumerate(parts)])
    angles, speeds = (np.concatenate([p[i] for p in parts]) for i in (1, 2))
    azimuth = 2 * np.pi * times / SWEEP
    elevation = np.radians(-15.0 + 2.0 * rng.integers(0, 16, len(times)))
    beams = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        axis=1,
    )
    at_true = angles - speeds * delay
    origins = turned(AXIS, at_true, np.tile(true.translation, (len(times), 1)))
    ranges = distance(origins, turned(AXIS, at_true, beams @ true.R.T))
    points = beams * (ranges + rng.normal(0.0, 1.0, len(ranges)) * sigma)[:, None]
    return Revolutions(
        points,
        angles,
        speeds,
        np.floor(angles / np.pi).astype(np.int64) % 2,
        (times / SWEEP).astype(np.int64),
        (Stretch(0.0, float(length.sum()), n_turns, float(rates[0])),),
    )


def distance(origins, directions):
    """From inside the room to its walls along unit vectors (N, 3)."""
    with np.errstate(divide="ignore"):
        to_walls = np.where(directions > 0, HIGH - origins, LOW - origins) / directions
    return np.min(np.where(np.isfinite(to_walls), to_walls, np.inf), axis=1)


@pytest.fixture(scope="session")
def room():
    """Return the axis, the nominal place of the lidar, and makers of places and revolutions."""
    from types import SimpleNamespace

    return SimpleNamespace(axis=AXIS, nominal=NOMINAL, perturbed=perturbed, revolution=revolution)
