# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a recording is in a map, found by its places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.closing.pose_graph import deform_trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.closing.places import Candidate, Place

# Two places that put the recording this much apart contradict each other, m and share of the way between
# them: more than odometry drifts.
_APART = 0.5
_DRIFT = 0.02
_TURNED = np.radians(5.0)
# With places that agree this well the trajectory keeps its shape, m; the registration does the rest.
_RIGID = 0.3


@dataclass(frozen=True, slots=True)
class Placement:
    """An estimate put where its places are in a map.

    Attributes
    ----------
    estimate : in the map's frame, to within reach of the registration
    T_map_run : (4, 4) of the place that agrees best
    supporters : rows of the candidates that agree with it
    largest_deformation : m, how far places were from where that transform alone puts them
    """

    estimate: Estimate
    T_map_run: NDArray[np.float64]
    supporters: list[int]
    largest_deformation: float


def place_in_map(
    estimate: Estimate, candidates: Sequence[Candidate], places: Sequence[Place]
) -> Placement | None:
    """Move an estimate to where most of its recognized places agree that it is.

    Parameters
    ----------
    candidates : pairs of a place of the map and one of the recording, accepted or not
    places : of the recording

    Returns
    -------
    None where no place was recognized.
    """
    accepted = [k for k, c in enumerate(candidates) if c.accepted and c.alignment is not None]
    if not accepted:
        return None
    nodes = {k: _node(candidates[k], places, estimate.trajectory) for k in accepted}
    groups = {k: [o for o in accepted if _agree(nodes[k], nodes[o])] for k in accepted}
    best = max(accepted, key=lambda k: (len(groups[k]), _weight(candidates[k])))
    T = nodes[best].T_map_run
    chosen = _one_each({k: nodes[k] for k in groups[best]}, candidates)
    rigid = _moved(estimate, T)
    apart = [float(np.linalg.norm(n.there - _put(T, n.here))) for n in chosen]
    if max(apart) > _RIGID:
        rigid = replace(estimate, trajectory=_bent(estimate.trajectory, chosen))
    return Placement(rigid, T, groups[best], max(apart))


@dataclass(frozen=True, slots=True)
class _Node:
    """A pose of the recording where a place says it is in the map."""

    time: float
    here: NDArray[np.float64]
    way: float
    T_map_run: NDArray[np.float64]
    place: int

    @property
    def there(self) -> NDArray[np.float64]:
        return _put(self.T_map_run, self.here)


def _node(candidate: Candidate, places: Sequence[Place], trajectory: Trajectory) -> _Node:
    assert candidate.alignment is not None  # of those that are accepted
    span = places[candidate.j].span or (trajectory.times[0], trajectory.times[-1])
    time = float(np.clip(0.5 * sum(span), trajectory.times[0], trajectory.times[-1]))
    until = trajectory.positions[trajectory.times <= time][::100]
    way = float(np.linalg.norm(np.diff(until, axis=0), axis=1).sum())
    here, _ = trajectory.interpolate(np.array([time]))
    return _Node(time, here[0], way, candidate.alignment.T_a_b, candidate.j)


def _agree(a: _Node, b: _Node) -> bool:
    """Whether two places put the recording at the same spot, but for drift."""
    apart = np.linalg.norm(_put(a.T_map_run, b.here) - b.there)
    turn = geometry.log(geometry.from_matrices(a.T_map_run[:3, :3].T @ b.T_map_run[:3, :3]))
    return bool(
        apart < _APART + _DRIFT * abs(a.way - b.way) and float(np.linalg.norm(turn)) < _TURNED
    )


def _one_each(nodes: dict[int, _Node], candidates: Sequence[Candidate]) -> list[_Node]:
    """Of every place of the recording the node that most surfels speak for, in order of time."""
    best: dict[int, int] = {}
    for k, node in nodes.items():
        other = best.get(node.place)
        if other is None or _weight(candidates[k]) > _weight(candidates[other]):
            best[node.place] = k
    return sorted((nodes[k] for k in best.values()), key=lambda n: n.time)


def _weight(candidate: Candidate) -> int:
    return 0 if candidate.agreement is None else candidate.agreement.n_alike


def _moved(estimate: Estimate, T: NDArray[np.float64]) -> Estimate:
    poses = estimate.trajectory
    turn = np.broadcast_to(geometry.from_matrices(T[:3, :3]), poses.quats_xyzw.shape)
    moved = Trajectory(
        poses.times, _put(T, poses.positions), geometry.multiply(turn, poses.quats_xyzw)
    )
    return replace(estimate, trajectory=moved)


def _bent(trajectory: Trajectory, nodes: Sequence[_Node]) -> Trajectory:
    times = np.array([n.time for n in nodes])
    _, quats = trajectory.interpolate(times)
    turns = geometry.from_matrices(np.stack([n.T_map_run[:3, :3] for n in nodes]))
    there = np.stack([n.there for n in nodes])
    return deform_trajectory(trajectory, times, there, geometry.multiply(turns, quats))


def _put(T: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    moved: NDArray[np.float64] = points @ T[:3, :3].T + T[:3, 3]
    return moved
