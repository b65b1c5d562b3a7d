# SPDX-License-Identifier: MIT OR Apache-2.0
"""A room of exact walls, with a box that was not there before, or is not there any more."""

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.closing.localize import Difference, ReferenceCloud
from bentwing.map.chunk import MapChunk

ROOM = np.array([[-4.0, 5.0], [-3.0, 4.0], [-1.5, 1.8]])
BOX = np.array([[2.0, 3.0], [1.0, 2.0], [-1.5, 0.0]])
SECONDS = 12.0
RATE = 50_000
STILL = Trajectory(
    np.array([0.0, SECONDS]), np.zeros((2, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (2, 1))
)


def seen(*, box, seed, noise=0.0):
    """Points in order of time from the origin, all around."""
    rng = np.random.default_rng(seed)
    rays = rng.normal(size=(int(SECONDS * RATE), 3))
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    with np.errstate(divide="ignore"):
        far = (np.where(rays > 0, ROOM[:, 1], ROOM[:, 0]) / rays).min(axis=1)
        if box:
            sides = np.sort(BOX.T[:, None, :] / rays, axis=0)
            enter, leave = sides[0].max(axis=1), sides[1].min(axis=1)
            far = np.where((enter < leave) & (enter > 0), enter, far)
    return rays * (far + rng.normal(0, noise, len(far)))[:, None]


def chunks(points):
    times = np.linspace(0.0, SECONDS, len(points))
    for part in np.array_split(np.arange(len(points)), 12):
        yield MapChunk(points[part], times[part], np.zeros(len(part), np.float32))


def compared(before, after, *, origins=True):
    cloud = ReferenceCloud()
    for part in np.array_split(before, 4):
        cloud.add(part, np.zeros_like(part) if origins else None)
    difference = Difference(cloud, STILL)
    n = sum(len(chunk) for chunk in difference.watch(chunks(after)))
    assert n == len(after)
    return difference


def in_box(points, margin=0.02):
    return ((points > BOX[:, 0] - margin) & (points < BOX[:, 1] + margin)).all(axis=1)


def test_nothing_changes_where_nothing_has():
    found = compared(seen(box=True, seed=1, noise=0.01), seen(box=True, seed=2, noise=0.01))
    assert len(found.change.appeared) == len(found.change.disappeared) == 0
    assert found.record["points"] == SECONDS * RATE


@pytest.mark.parametrize("origins", [True, False])
def test_a_new_box_appears(origins):
    found = compared(seen(box=False, seed=1), seen(box=True, seed=2), origins=origins)
    assert in_box(found.change.appeared).all()
    # three of its sides, in voxels of 5 cm, but for what is near the floor
    assert len(found.change.appeared) > 500
    assert len(found.change.disappeared) == 0


def test_a_box_that_was_taken_away_has_disappeared():
    found = compared(seen(box=True, seed=1), seen(box=False, seed=2))
    assert in_box(found.change.disappeared).all()
    assert len(found.change.disappeared) > 100
    # behind it is floor and wall that the map never saw, and nobody knows whether it was there
    assert len(found.change.appeared) == 0
    assert found.n_beyond > 1000


def test_what_stands_alone_is_not_believed():
    after = seen(box=False, seed=2)
    after[::25_000] *= 0.5  # 24 errors of the sensor in the middle of the room
    found = compared(seen(box=False, seed=1), after)
    assert len(found.change.appeared) == 0
