# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where parts that have places in common lie in one map: a robust pose graph of their places.

Each place is a node. Neighbours in a part are linked by its trajectory, which is trusted; matches of
places are links that may be false; all nodes know where gravity is. A first guess is not needed: parts
are put together along the matches, beginning with the first.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.transform import from_poses, inverse
from bentwing.closing.joining.matches import Match, Part, connected
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.places import link_between
from bentwing.closing.pose_graph import (
    GravityTerms,
    Links,
    PoseGraph,
    deform_trajectory,
    solve_pose_graph,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.places import Place
    from bentwing.closing.pose_graph import Solution

    Nodes = dict[tuple[Part, int], int]

# What a part is wrong by over a second of its trajectory, rad and m: a random walk, a few times that of
# closed trajectories, so that matches decide where they are many.
_TURN_WALK = 5e-4
_SHIFT_WALK = 2e-3
# What is known of gravity, rad.
_LEVEL = 3e-3
# What the registration that follows bridges without trouble is no contradiction, m and rad.
_FALSE_SHIFT = 0.2
_FALSE_TURN = np.radians(1.0)
# So much more than by itself counts a match that a user has named: the way between bends until it is met,
# however far it has drifted, and the registration that follows makes it exact.
_NAMED = 1e4
# Parts of the same run that nothing else connects stay roughly as the run had them, rad and m.
_SAME_RUN = (0.2, 3.0)


@dataclass(frozen=True, slots=True)
class Placed:
    """Parts in one map.

    Attributes
    ----------
    trajectories : of the parts, in the map of the first one
    matches : all of them, with those that the graph has rejected
    record : what was solved, for run.json
    """

    trajectories: dict[Part, Trajectory]
    matches: list[Match]
    record: dict[str, Any]


def place_parts(
    trajectories: dict[Part, Trajectory],
    places: dict[Part, list[Place]],
    matches: Sequence[Match],
) -> Placed:
    """Bend the parts of one group so that they agree on the places that they have in common.

    Parameters
    ----------
    trajectories : of the parts, each in its run's map; the first one stays where it is
    places : of the parts
    matches : between them

    Raises
    ------
    EstimationError
        If the graph cannot be solved.
    """
    graph = _Graph(trajectories, places)
    rows = [k for k, m in enumerate(matches) if m.believed]
    links, nodes = graph.links([matches[k] for k in rows])
    positions, quats = graph.guess([matches[k] for k in rows])
    fixed = np.zeros(len(positions), dtype=np.bool_)
    fixed[0] = True
    found = solve_pose_graph(
        PoseGraph(positions, quats, links, fixed, graph.gravity(len(positions)))
    )
    n_trusted = len(links) - len(rows)
    after = list(matches)
    for row in found.rejected:
        k = rows[int(row) - n_trusted]
        why = _contradiction(links, int(row), found)
        if why is not None:
            after[k] = matches[k].rejected(why)
    moved = {
        part: _bent(trajectory, nodes, graph.times[part], part, found)
        for part, trajectory in trajectories.items()
    }
    record = {
        "n_nodes": len(positions),
        "n_links": len(links),
        "n_matches": len(rows),
        "n_unweighted": len(found.rejected),
        "n_rejected": sum(m.believed for m in matches) - sum(m.believed for m in after),
        "cost": found.cost,
        "iterations": found.iterations,
        "converged": found.converged,
    }
    return Placed(moved, after, record)


def place_groups(
    trajectories: dict[Part, Trajectory],
    places: dict[Part, list[Place]],
    matches: Sequence[Match],
    ties: Sequence[tuple[Part, Part]] = (),
) -> tuple[list[Placed], list[Match]]:
    """Find the groups of parts that belong together, and place each group.

    Matches that a group rejects may have been all that held it together: then it is parted again.

    Parameters
    ----------
    ties : parts that belong together whether they have places in common or not

    Returns
    -------
    The groups in the order of their first parts, and all matches with the reasons why they are not
    believed.
    """
    known = list(matches)
    while True:
        groups = _tied(connected(trajectories, known), ties)
        placed = []
        for group in groups:
            own = [k for k, m in enumerate(known) if m.a in group and m.b in group]
            found = place_parts(
                {part: trajectories[part] for part in group},
                {part: places[part] for part in group},
                [known[k] for k in own],
            )
            placed.append(found)
            for k, match in zip(own, found.matches, strict=True):
                known[k] = match
        if _tied(connected(trajectories, known), ties) == groups:
            return placed, known


def _tied(groups: list[list[Part]], ties: Sequence[tuple[Part, Part]]) -> list[list[Part]]:
    """Join the groups of parts that are tied."""
    for a, b in ties:
        first = next(g for g in groups if a in g)
        second = next(g for g in groups if b in g)
        if first is not second:
            groups = [g for g in groups if g is not first and g is not second]
            groups.append(sorted(first + second))
    return sorted(groups)


class _Graph:
    """Nodes of the parts: their places, or the middle of a part without any.

    Places of a very short part may have the same middle, and share a node.
    """

    def __init__(
        self, trajectories: dict[Part, Trajectory], places: dict[Part, list[Place]]
    ) -> None:
        self._trajectories = trajectories
        self.times = {
            part: np.unique(_middles(t, places[part])) for part, t in trajectories.items()
        }
        self.nodes: Nodes = {}
        self._poses: list[NDArray[np.float64]] = []
        for part, trajectory in trajectories.items():
            positions, quats = trajectory.interpolate(self.times[part])
            for k, T in enumerate(from_poses(positions, quats)):
                self.nodes[part, k] = len(self._poses)
                self._poses.append(T)

    def links(self, matches: Sequence[Match]) -> tuple[Links, Nodes]:
        """Return the trusted links within parts and runs, and behind them those of the matches."""
        ends: list[tuple[int, int]] = []
        poses, information = [], []
        for part, times in self.times.items():
            for k in range(len(times) - 1):
                i, j = self.nodes[part, k], self.nodes[part, k + 1]
                ends.append((i, j))
                poses.append(inverse(self._poses[i]) @ self._poses[j])
                elapsed = float(times[k + 1] - times[k])
                information.append(
                    _information(_TURN_WALK * elapsed**0.5, _SHIFT_WALK * elapsed**0.5)
                )
        for i, j in self._neighbouring_segments():
            ends.append((i, j))
            poses.append(inverse(self._poses[i]) @ self._poses[j])
            information.append(_information(*_SAME_RUN))
        n_trusted = len(ends)
        for match in matches:
            i, j = self._node_of(match.a, match.place_a), self._node_of(match.b, match.place_b)
            link = link_between(self._poses[i], self._poses[j], match.alignment)
            ends.append((i, j))
            poses.append(from_poses(link.position, link.quat_xyzw))
            information.append(link.information * (_NAMED if match.is_named else 1.0))
        shape = np.array(poses).reshape(-1, 4, 4)
        is_trusted = [True] * n_trusted + [match.is_named for match in matches]
        links = Links(
            np.array(ends, np.int64).reshape(-1, 2),
            np.ascontiguousarray(shape[:, :3, 3]),
            geometry.from_matrices(shape[:, :3, :3]) if len(shape) else np.zeros((0, 4)),
            np.array(information).reshape(-1, 6, 6),
            np.array(is_trusted, dtype=np.bool_),
        )
        return links, self.nodes

    def guess(self, matches: Sequence[Match]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return poses of the nodes: parts put together along the best matches, from the first on."""
        parts = list(self._trajectories)
        T_map = {parts[0]: np.eye(4)}
        best = sorted(matches, key=lambda m: -_strength(m))
        while len(T_map) < len(parts):
            joint = next((m for m in best if (m.a in T_map) != (m.b in T_map)), None)
            if joint is None:
                lost = next(p for p in parts if p not in T_map)
                same = [p for p in T_map if p.run == lost.run]
                T_map[lost] = T_map[same[-1]] if same else np.eye(4)
            elif joint.a in T_map:
                T_map[joint.b] = T_map[joint.a] @ joint.alignment.T_a_b
            else:
                T_map[joint.a] = T_map[joint.b] @ inverse(joint.alignment.T_a_b)
        guessed = np.array(
            [T_map[part] @ self._poses[node] for (part, _), node in self.nodes.items()]
        )
        return np.ascontiguousarray(guessed[:, :3, 3]), geometry.from_matrices(guessed[:, :3, :3])

    def gravity(self, n: int) -> GravityTerms:
        """Return what the nodes know of gravity: each run's map is level."""
        ups = np.array([pose[2, :3] for pose in self._poses])
        return GravityTerms(np.arange(n), ups, np.full(n, _LEVEL**-2))

    def _neighbouring_segments(self) -> list[tuple[int, int]]:
        pairs = []
        for part in self._trajectories:
            following = Part(part.run, part.segment + 1)
            if following in self._trajectories:
                last = len(self.times[part]) - 1
                pairs.append((self.nodes[part, last], self.nodes[following, 0]))
        return pairs

    def _node_of(self, part: Part, place: Place) -> int:
        middle = _middles(self._trajectories[part], [place])[0]
        return self.nodes[part, int(np.searchsorted(self.times[part], middle))]


def _middles(trajectory: Trajectory, places: Sequence[Place]) -> NDArray[np.float64]:
    """Return the times (K,) of the middles of places, within the trajectory; without any its own."""
    first, last = trajectory.times[0], trajectory.times[-1]
    if not places:
        return np.array([0.5 * (first + last)])
    return np.clip([middle_of(p) for p in places], first, last)


def _bent(
    trajectory: Trajectory,
    nodes: Nodes,
    times: NDArray[np.float64],
    part: Part,
    found: Solution,
) -> Trajectory:
    rows = [nodes[part, k] for k in range(len(times))]
    return deform_trajectory(trajectory, times, found.positions[rows], found.quats_xyzw[rows])


def _contradiction(links: Links, row: int, found: Solution) -> str | None:
    """Return by how much a link that the graph left out contradicts it; None where it is little.

    The graph measures links by each other: where all agree to millimetres it leaves out one that is
    a centimetre off, which is true all the same.
    """
    i, j = links.nodes[row]
    T_i, T_j = from_poses(found.positions[[i, j]], found.quats_xyzw[[i, j]])
    measured = from_poses(links.positions[row], links.quats_xyzw[row])
    off = inverse(measured) @ inverse(T_i) @ T_j
    shift = float(np.linalg.norm(off[:3, 3]))
    turn = float(np.linalg.norm(geometry.log(geometry.from_matrices(off[:3, :3]))))
    if shift < _FALSE_SHIFT and turn < _FALSE_TURN:
        return None
    return f"contradicts the other matches by {shift:.2f} m and {np.degrees(turn):.1f}°"


def _strength(match: Match) -> float:
    """Order matches by how much speaks for them."""
    agreement = match.candidate.agreement
    return 0.0 if agreement is None else agreement.agreement * agreement.overlap


def _information(turn: float, shift: float) -> NDArray[np.float64]:
    return np.diag([turn**-2] * 3 + [shift**-2] * 3)
