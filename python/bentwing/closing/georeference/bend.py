# SPDX-License-Identifier: MIT OR Apache-2.0
"""A trajectory that gives way to fixes and control points as far as it may have drifted.

Every second the trajectory may turn a little more about the vertical and shift a little more; how
much follows from the way between. The tilt is gravity's and is not touched. One sparse linear
least-squares problem, with weights that let false fixes go.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from bentwing.base import geometry
from bentwing.closing.georeference.placement import GATE
from bentwing.closing.pose_graph import deform_trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.placement import Positions, Surfaces

    Array = NDArray[np.float64]

NODE_STEP = 1.0  # s
# What the odometry drifts at random, by the root of the metres it went: 0.1 % of 10 m are 3 mm/√m.
SHIFT_DRIFT = 0.003  # m/√m
TURN_DRIFT = 2e-4  # rad/√m
STILL = 0.05  # m, added to the way: a carrier that hovers drifts too
BROKEN = 100.0  # factor of the drift over a break of the trajectory
_ITERATIONS = 12


@dataclass(frozen=True, slots=True)
class Observations:
    """What the trajectory gives way to, in the frame of the map.

    Attributes
    ----------
    times : (N,) s
    levers : (N, 3) m, from the IMU to the point, in the axes of the map
    gaps : (N, 3) m, by which the point should move
    weights : (N, 3, 3) 1/m², their information
    doubtful : (N,) bool, whether it may be false
    """

    times: Array
    levers: Array
    gaps: Array
    weights: Array
    doubtful: NDArray[np.bool_]


def of_fixes(times: Array, levers: Array, positions: Positions) -> Observations:
    """Return fixes as observations; all of `positions` is in the frame of the map."""
    gaps = positions.targets - positions.points
    return Observations(times, levers, gaps, positions.information, np.ones(len(times), np.bool_))


def of_surfaces(times: Array, levers: Array, surfaces: Surfaces, targets: Array) -> Observations:
    """Return control points as observations of the surfaces that should pass through them."""
    normals = surfaces.normals
    weights = np.einsum("ki,kj,k->kij", normals, normals, surfaces.sigmas**-2.0)
    gaps = targets - surfaces.points
    return Observations(times, levers, gaps, weights, np.zeros(len(times), np.bool_))


def bend(
    trajectory: Trajectory,
    observations: Sequence[Observations],
    segments: Sequence[tuple[float, float]] = (),
) -> Trajectory:
    """Let the trajectory give way.

    Parameters
    ----------
    trajectory : in the map
    observations : at times within the trajectory
    segments : first and last time of each stretch without a break, s
    """
    first, last = float(trajectory.times[0]), float(trajectory.times[-1])
    nodes = np.linspace(first, last, max(2, round((last - first) / NODE_STEP) + 1))
    joined = [np.concatenate(parts) for parts in zip(*map(_fields, observations), strict=True)]
    seen = Observations(*joined)
    positions, quats = trajectory.interpolate(nodes)
    corrections = _solve(nodes, positions, seen, segments)
    turns = geometry.exp(np.c_[np.zeros((len(nodes), 2)), corrections[:, 0]])
    return deform_trajectory(
        trajectory, nodes, positions + corrections[:, 1:], geometry.multiply(turns, quats)
    )


def _fields(o: Observations) -> tuple[Array, Array, Array, Array, NDArray[np.bool_]]:
    return o.times, o.levers, o.gaps, o.weights, o.doubtful


def _solve(
    nodes: Array, positions: Array, seen: Observations, segments: Sequence[tuple[float, float]]
) -> Array:
    """Turn about the vertical and shift `(K, 4)` of every node."""
    stiff = _stiffness(nodes, positions, segments)
    rows = _rows(nodes, seen)
    values, vectors = np.linalg.eigh(seen.weights)  # those of surfaces are of rank one
    factors = np.sqrt(np.maximum(values, 0.0))[..., None] * vectors.transpose(0, 2, 1)
    gaps = np.einsum("nij,nj->ni", factors, seen.gaps)
    trust = np.ones(len(seen.times))
    solution = np.zeros(4 * len(nodes))
    for _ in range(_ITERATIONS):
        weights = np.repeat(np.sqrt(trust), 3)
        weighted = _weigh(rows, factors, weights)
        normal = (stiff.T @ stiff + weighted.T @ weighted).tocsc()
        solution = splu(normal).solve(weighted.T @ (weights * gaps.ravel()))
        left = gaps.ravel() - _weigh(rows, factors, np.ones_like(weights)) @ solution
        squared = (left.reshape(-1, 3) ** 2).sum(axis=1)
        trust = np.where(seen.doubtful, 1 / (1 + squared / GATE) ** 2, 1.0)
    return solution.reshape(-1, 4)


def _stiffness(
    nodes: Array, positions: Array, segments: Sequence[tuple[float, float]]
) -> coo_matrix:
    """Rows that hold neighbouring nodes together, and one weak one that makes the rest definite."""
    ways = np.diff(positions, axis=0)
    roots = np.sqrt(np.linalg.norm(ways, axis=1) + STILL)
    for (_, end), (begin, _) in pairwise(segments):
        roots[(nodes[:-1] < begin) & (nodes[1:] > end)] *= BROKEN
    k = np.arange(len(ways))
    turn, shift = 1 / (TURN_DRIFT * roots), 1 / (SHIFT_DRIFT * roots)
    entries = [(4 * k, 4 * k + 4, turn), (4 * k, 4 * k, -turn)]
    for axis in range(3):
        row, column = 4 * k + 1 + axis, 4 * k + 1 + axis
        entries += [(row, column + 4, shift), (row, column, -shift)]
    # A turn of the earlier node carries the later one along: ẑ × way.
    entries += [(4 * k + 1, 4 * k, ways[:, 1] * shift), (4 * k + 2, 4 * k, -ways[:, 0] * shift)]
    n, m = 4 * len(ways), 4 * len(nodes)
    weak = n + np.arange(4)
    entries.append((weak, np.arange(4), np.full(4, 1e-3)))
    row, column, value = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return coo_matrix((value, (row, column)), shape=(n + 4, m)).tocsr()


def _rows(nodes: Array, seen: Observations) -> coo_matrix:
    """How observed points (N · 3) move with the nodes."""
    i = np.clip(np.searchsorted(nodes, seen.times, side="right") - 1, 0, len(nodes) - 2)
    share = np.clip((seen.times - nodes[i]) / (nodes[i + 1] - nodes[i]), 0, 1)
    n = np.arange(len(seen.times))
    entries = []
    for node, part in ((i, 1 - share), (i + 1, share)):
        entries += [(3 * n + axis, 4 * node + 1 + axis, part) for axis in range(3)]
        entries.append((3 * n, 4 * node, -part * seen.levers[:, 1]))
        entries.append((3 * n + 1, 4 * node, part * seen.levers[:, 0]))
    row, column, value = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return coo_matrix((value, (row, column)), shape=(3 * len(n), 4 * len(nodes))).tocsr()


def _weigh(rows: coo_matrix, factors: Array, weights: Array) -> coo_matrix:
    n = np.arange(len(factors))
    row = (3 * n[:, None, None] + np.arange(3)[None, :, None] + np.zeros((1, 1, 3), int)).ravel()
    column = (3 * n[:, None, None] + np.arange(3)[None, None, :] + np.zeros((1, 3, 1), int)).ravel()
    values = factors.ravel() * weights[row]
    blocks = coo_matrix((values, (row, column)), shape=(3 * len(n), 3 * len(n))).tocsr()
    return blocks @ rows
