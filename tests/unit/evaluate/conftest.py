# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight whose poses are known at any time, and rooms whose walls are."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.alignment import Alignment


@pytest.fixture(scope="session")
def flight():
    """Return the poses of a lively flight of 60 s at any times."""

    def at(times):
        t = np.asarray(times, float)
        phase = 0.25 * t + 0.8 * np.sin(0.31 * t)
        positions = np.stack(
            [9 * np.cos(phase), 6 * np.sin(phase), 2 + 0.7 * np.sin(0.4 * t)], axis=1
        )
        tilt = geometry.exp(
            np.stack([0.25 * np.sin(1.1 * t), 0.2 * np.cos(0.7 * t), 0 * t], axis=1)
        )
        yaw = geometry.exp(np.stack([0 * t, 0 * t, 0.9 * t], axis=1))
        return Trajectory(t, positions, geometry.multiply(yaw, tilt))

    return at


@pytest.fixture(scope="session")
def elsewhere():
    """A rigid motion to another frame."""
    R = geometry.to_matrices(geometry.exp(np.array([0.02, -0.03, 2.1])))
    return Alignment(R, np.array([120.0, -40.0, 7.0]))


@pytest.fixture(scope="session")
def hall():
    """Return points on the sides of an L-shaped hall, and the distance of each from its side."""

    def make(n=200_000, noise=0.0, seed=0, offset=0.0):
        rng = np.random.default_rng(seed)
        corners = np.array([[0, 0], [12, 0], [12, 5], [6, 5], [6, 9], [0, 9]], float)
        ends = np.roll(corners, -1, axis=0)
        lengths = np.linalg.norm(ends - corners, axis=1)
        side = rng.choice(6, n // 2, p=lengths / lengths.sum())
        u = rng.uniform(0, 1, (n // 2, 1))
        level = corners[side] + u * (ends - corners)[side]
        along = ((ends - corners) / lengths[:, None])[side]
        inward = np.stack([-along[:, 1], along[:, 0]], axis=1)
        off = offset + rng.normal(0, noise, n // 2) if noise else np.full(n // 2, offset)
        walls = np.column_stack([level - off[:, None] * inward, rng.uniform(0, 3, n // 2)])
        floor = rng.uniform([0, 0], [12, 9], (n, 2))
        floor = floor[(floor[:, 0] < 6) | (floor[:, 1] < 5)][: n // 2]
        down = offset + rng.normal(0, noise, len(floor)) if noise else np.full(len(floor), offset)
        return np.vstack([walls, np.column_stack([floor, -down])])

    return make
