# SPDX-License-Identifier: MIT OR Apache-2.0
"""A furnished hall whose boxes stand where a seed put them, seen from two paths."""

import functools

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import apply, upright
from bentwing.closing.places import describe_run

SIZE = np.array([18.0, 13.0, 5.0])
T_B_WORLD = upright(2.1, np.array([-7.0, 31.0, 4.0]))


def hall(seed, n_boxes=18, changed=0):
    """Corners (low, high) of boxes in a hall; the first is the hall itself, seen from inside.

    The first `changed` boxes stand where another seed puts them.
    """
    rng = np.random.default_rng(seed)
    low = np.column_stack([rng.uniform(1.0, SIZE[:2] - 2.5, (n_boxes, 2)), np.zeros(n_boxes)])
    high = low + rng.uniform((0.4, 0.4, 0.5), (1.5, 1.5, 3.5), (n_boxes, 3))
    if changed:
        others = hall(seed + 1000, changed)
        low[:changed], high[:changed] = others[0][1:], others[1][1:]
    return np.vstack([np.zeros(3), low]), np.vstack([SIZE, high])


def cast(origins, directions, boxes):
    """Ranges (N,) from within the hall."""
    low, high = boxes
    with np.errstate(divide="ignore"):
        inverse = 1.0 / directions
    t = np.stack([(low[:, None] - origins) * inverse, (high[:, None] - origins) * inverse])
    near, far = t.min(axis=0).max(axis=2), t.max(axis=0).min(axis=2)
    hit = np.where((near < far) & (near > 0), near, np.inf)
    return np.minimum(far[0], hit[1:].min(axis=0))


@functools.cache
def seen(seed, path, n=60_000, seconds=10.0, changed=0):
    """Points, times and trajectory of a scanner on the way `path`, in the hall's frame."""
    rng = np.random.default_rng([seed, path])
    times = np.linspace(0.0, seconds, n)
    track = np.linspace(0.0, seconds, 101)
    start, end = [((2.5, 2.0, 4.3), (15.0, 10.5, 4.0)), ((14.5, 3.0, 3.9), (3.0, 11.0, 4.4))][path]
    positions = np.linspace(start, end, 101)
    origins = np.column_stack([np.interp(times, track, positions[:, i]) for i in range(3)])
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    ranges = cast(origins, directions, hall(seed, changed=changed)) + rng.normal(0.0, 0.01, n)
    upright_quats = np.tile([0.0, 0.0, 0.0, 1.0], (101, 1))
    trajectory = Trajectory(track, positions, upright_quats)
    return origins + ranges[:, None] * directions, times, trajectory


def moved(points, times, trajectory, T):
    """The same in another frame."""
    positions = apply(T, trajectory.positions)
    return (
        apply(T, points),
        times,
        Trajectory(trajectory.times, positions, trajectory.quats_xyzw),
    )


@pytest.fixture(scope="session")
def places_a():
    return describe_run(*seen(3, 0))


@pytest.fixture(scope="session")
def places_b():
    """The same hall from another path, in a frame turned by 2.1 rad."""
    return describe_run(*moved(*seen(3, 1), T_B_WORLD))
