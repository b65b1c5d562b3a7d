# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a recording is in a map, found by its places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.base.transform import apply
from bentwing.closing.agreement import Sighting, largest_group
from bentwing.closing.pose_graph import deform_trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.closing.places import Candidate, Place

# With places that agree this well the trajectory keeps its shape, m; the registration does the rest.
_RIGID = 0.3


@dataclass(frozen=True, slots=True)
class Placement:
    """An estimate put where its places are in a map.

    Attributes
    ----------
    estimate : in the map's frame, to within reach of the registration
    T_map_run : (4, 4) of the place, among those that agree, that most surfels speak for
    supporters : rows of the candidates that agree
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
    None where no place was recognized, or others that are as many put it elsewhere.
    """
    accepted = [k for k, c in enumerate(candidates) if c.accepted and c.alignment is not None]
    if not accepted:
        return None
    nodes = [_node(candidates[k], places, estimate.trajectory) for k in accepted]
    # the map does not drift
    group = largest_group([Sighting(n.T_map_run, n.here, 0.0, n.time) for n in nodes])
    if group.contested:
        return None
    agreeing = {k: n for k, n, is_in in zip(accepted, nodes, group.members, strict=True) if is_in}
    T = agreeing[max(agreeing, key=lambda k: _weight(candidates[k]))].T_map_run
    chosen = _one_each(agreeing, candidates)
    rigid = _moved(estimate, T)
    apart = [float(np.linalg.norm(n.there - apply(T, n.here))) for n in chosen]
    if max(apart) > _RIGID:
        rigid = replace(estimate, trajectory=_bent(estimate.trajectory, chosen))
    return Placement(rigid, T, list(agreeing), max(apart))


@dataclass(frozen=True, slots=True)
class _Node:
    """A pose of the recording where a place says it is in the map."""

    time: float
    here: NDArray[np.float64]
    T_map_run: NDArray[np.float64]
    place: int

    @property
    def there(self) -> NDArray[np.float64]:
        return apply(self.T_map_run, self.here)


def _node(candidate: Candidate, places: Sequence[Place], trajectory: Trajectory) -> _Node:
    assert candidate.alignment is not None  # of those that are accepted
    span = places[candidate.j].span or (trajectory.times[0], trajectory.times[-1])
    time = float(np.clip(0.5 * sum(span), trajectory.times[0], trajectory.times[-1]))
    here, _ = trajectory.interpolate(np.array([time]))
    return _Node(time, here[0], candidate.alignment.T_a_b, candidate.j)


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
        poses.times, apply(T, poses.positions), geometry.multiply(turn, poses.quats_xyzw)
    )
    return replace(estimate, trajectory=moved)


def _bent(trajectory: Trajectory, nodes: Sequence[_Node]) -> Trajectory:
    times = np.array([n.time for n in nodes])
    _, quats = trajectory.interpolate(times)
    turns = geometry.from_matrices(np.stack([n.T_map_run[:3, :3] for n in nodes]))
    there = np.stack([n.there for n in nodes])
    return deform_trajectory(trajectory, times, there, geometry.multiply(turns, quats))
