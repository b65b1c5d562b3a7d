# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two runs through the same corridor of places, whose poses and matches are known exactly."""

from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import inverse, upright
from bentwing.closing.joining.matches import Match, Part
from bentwing.closing.places import Agreement, Alignment, Candidate

SECONDS = 60.0


def flown(T_map_world):
    """A level flight through the world as its run's map has it."""
    times = np.arange(0.0, SECONDS, 0.05)
    positions = np.column_stack([0.5 * times, np.sin(times / 9), 0.1 * np.cos(times / 5)])
    moved = positions @ T_map_world[:3, :3].T + T_map_world[:3, 3]
    yaw = np.arctan2(T_map_world[1, 0], T_map_world[0, 0])
    quat = np.array([0.0, 0.0, np.sin(yaw / 2), np.cos(yaw / 2)])
    return Trajectory(times, moved, np.tile(quat, (len(times), 1)))


def place(k, centre):
    """All that the graph asks of a place."""
    return SimpleNamespace(span=(10.0 * k, 10.0 * k + 10.0), centre=np.asarray(centre))


@pytest.fixture
def corridor():
    """Trajectories, places and a maker of matches of two runs; the true transform between them."""
    frames = [np.eye(4), upright(1.2, np.array([5.0, -3.0, 0.7]))]
    trajectories = {Part(r, 0): flown(frames[r]) for r in range(2)}
    places = {
        part: [place(k, t.interpolate(np.array([10.0 * k + 5.0]))[0][0]) for k in range(6)]
        for part, t in trajectories.items()
    }
    T_0_1 = inverse(frames[1])

    def match(i, j, shift=(0.0, 0.0, 0.0), agreement=0.9):
        T = T_0_1.copy()
        T[:3, 3] += shift
        a, b = places[Part(0, 0)][i], places[Part(1, 0)][j]
        information = np.diag([1e6] * 3 + [1e6] * 3)
        alignment = Alignment(T, information, a.centre, 500)
        said = Agreement(0.6, agreement, 0.0, 0.1, 300, 0.005)
        candidate = Candidate(i, j, 100.0, None, 20, alignment, said)
        return Match(Part(0, 0), Part(1, 0), candidate, a, b, None)

    return SimpleNamespace(
        trajectories=trajectories, places=places, match=match, T_0_1=T_0_1, parts=list(trajectories)
    )
