# SPDX-License-Identifier: MIT OR Apache-2.0
"""A collision-free tour of a world over a random roadmap (Kavraki et al. 1996)."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.scenes import World

    Array = NDArray[np.float64]

N_NODES = 260
N_NEIGHBOURS = 9
SAMPLING = 0.2
"""m, spacing at which an edge's clearance is checked."""
PAD_RADIUS = 0.45
PAD_ROUGHNESS = 0.12


@dataclass(frozen=True, slots=True)
class Tour:
    """Where to fly.

    Attributes
    ----------
    pad : (3,) m, the ground below the first way point
    way_points : (K, 3) m; the last is the first
    """

    pad: Array
    way_points: Array


def plan_tour(
    world: World,
    rng: np.random.Generator,
    length: float,
    clearance: float,
    heights: tuple[float, float] | None = None,
) -> Tour:
    """Plan a tour of about `length` metres that stays `clearance` away from every surface.

    It fills the site's box, or follows the ground at the given heights.
    """
    nodes = free_points(world, rng, clearance, heights)
    edges = _connect(world, nodes, clearance)
    home, pad = _choose_pad(world, rng, nodes, edges)
    distances, before = _shortest_paths(nodes, edges, home)
    reachable = np.flatnonzero(np.isfinite(distances))
    route, at, flown = [home], home, 0.0
    while flown < length - distances[at] or len(route) == 1:
        costs, previous = _shortest_paths(nodes, edges, at)
        others = reachable[reachable != at]
        goal = _next_goal(rng, others, costs[others], (costs + distances)[others], length - flown)
        route += _path(previous, at, goal)
        flown, at = flown + costs[goal], goal
    route += [*_path(before, home, at)[-2::-1], home]
    return Tour(pad, nodes[route])


def follow_route(world: World, length: float) -> Tour:
    """Follow the site's route in as many whole rounds as come nearest to `length` m.

    If not even half a round does, it leads as far along the route as there is time to come back.
    """
    corners = np.array(world.site.route)
    closed = np.vstack([corners, corners[:1]])
    reached = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    rounds = round(length / reached[-1])
    pad = _pad_below(world, corners[0])
    if pad is None:
        msg = "no level ground to take off from was found below the route: try another seed"
        raise UsageError(msg)
    if rounds:
        return Tour(pad, np.vstack([*[corners] * rounds, corners[:1]]))
    turn = np.array([np.interp(0.5 * length, reached, closed[:, i]) for i in range(3)])
    there = np.vstack([closed[reached < 0.5 * length], turn])
    return Tour(pad, np.vstack([there, there[-2::-1]]))


def free_points(
    world: World,
    rng: np.random.Generator,
    clearance: float,
    heights: tuple[float, float] | None = None,
) -> Array:
    """Draw places (K, 3) in the site's box that far from every surface, m."""
    low, high = np.array(world.site.low), np.array(world.site.high)
    candidates = rng.uniform(low, high, size=(12 * N_NODES, 3))
    if heights is not None:
        candidates = _above_ground(world, candidates, rng.uniform(*heights, len(candidates)))
    free = candidates[world.clearance(candidates) > clearance]
    if len(free) < 2:
        msg = (
            f"no place in this scene is {clearance:.1f} m away from every surface: try another seed"
        )
        raise UsageError(msg)
    return free[:N_NODES]


def _above_ground(world: World, points: Array, heights: Array) -> Array:
    """Points moved to `heights` above the ground; those over tables and roofs are left out."""
    down = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    ground = points[:, 2] - world.scene.cast(points, down, 200.0)[0]
    moved = np.column_stack([points[:, :2], ground + heights])
    return np.ascontiguousarray(moved[np.isfinite(ground) & (ground < world.site.pad_below)])


def _connect(world: World, nodes: Array, clearance: float) -> list[list[int]]:
    separation = np.linalg.norm(nodes[:, None] - nodes[None], axis=2)
    nearest = np.argsort(separation, axis=1, kind="stable")[:, 1 : N_NEIGHBOURS + 1]
    pairs = sorted({(min(i, j), max(i, j)) for i, row in enumerate(nearest) for j in row})
    counts = [int(separation[i, j] / SAMPLING) + 2 for i, j in pairs]
    samples = [np.linspace(nodes[i], nodes[j], n) for (i, j), n in zip(pairs, counts, strict=True)]
    free = world.clearance(np.vstack(samples)) > clearance
    firsts = np.cumsum([0, *counts[:-1]])
    edges: list[list[int]] = [[] for _ in nodes]
    for (i, j), is_free in zip(pairs, np.logical_and.reduceat(free, firsts), strict=True):
        if is_free:
            edges[i].append(int(j))
            edges[j].append(int(i))
    return edges


def _choose_pad(
    world: World, rng: np.random.Generator, nodes: Array, edges: list[list[int]]
) -> tuple[int, Array]:
    """Return a node of the largest connected part that stands over level, open ground."""
    best: tuple[int, int, Array] | None = None
    for node in rng.permutation(len(nodes)):
        pad = _pad_below(world, nodes[node])
        if pad is None:
            continue
        size = int(np.isfinite(_shortest_paths(nodes, edges, int(node))[0]).sum())
        if best is None or size > best[0]:
            best = size, int(node), pad
        if 2 * size > len(nodes):
            break
    if best is None or best[0] < 2:
        msg = "no level ground to take off from was found in this scene: try another seed"
        raise UsageError(msg)
    return best[1], best[2]


def _pad_below(world: World, node: Array) -> Array | None:
    """Return the ground under `node`, or None if it is too high, uneven or hemmed in."""
    around = PAD_RADIUS * np.array([(0, 0, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)])
    down = np.tile([0.0, 0.0, -1.0], (5, 1))
    heights = node[2] - world.scene.cast(node + around, down, 200.0)[0]
    if not np.isfinite(heights).all() or np.ptp(heights) > PAD_ROUGHNESS:
        return None
    pad = np.array([node[0], node[1], heights[0]])
    column = np.linspace(pad, node, int((node[2] - pad[2]) / SAMPLING) + 2)
    # Near the ground the ground itself is the nearest surface.
    needed = np.minimum(0.8, 0.7 * (column[:, 2] - pad[2]))
    is_open = (world.clearance(column) >= needed - 1e-9).all()
    return pad if is_open and pad[2] < world.site.pad_below else None


def _next_goal(
    rng: np.random.Generator,
    nodes: NDArray[np.int64],
    costs: Array,
    costs_there_and_home: Array,
    remaining: float,
) -> int:
    """Return the farthest of a few random nodes from which the way home is not too long."""
    drawn = rng.integers(len(nodes), size=6)
    round_trips = costs_there_and_home[drawn]
    affordable = round_trips <= max(remaining, float(round_trips.min()))
    return int(nodes[drawn[np.argmax(np.where(affordable, costs[drawn], -1.0))]])


def _shortest_paths(nodes: Array, edges: list[list[int]], start: int) -> tuple[Array, list[int]]:
    """Dijkstra: lengths of the ways from `start` and each node's predecessor."""
    lengths = np.full(len(nodes), np.inf)
    lengths[start] = 0.0
    before = [-1] * len(nodes)
    queue = [(0.0, start)]
    while queue:
        length, node = heapq.heappop(queue)
        if length > lengths[node]:
            continue
        for other in edges[node]:
            total = length + float(np.linalg.norm(nodes[other] - nodes[node]))
            if total < lengths[other]:
                lengths[other], before[other] = total, node
                heapq.heappush(queue, (total, other))
    return lengths, before


def _path(before: list[int], start: int, goal: int) -> list[int]:
    """Nodes after `start` on the way to `goal`."""
    path = [goal]
    while before[path[-1]] != start and path[-1] != start:
        path.append(before[path[-1]])
    return path[::-1]
