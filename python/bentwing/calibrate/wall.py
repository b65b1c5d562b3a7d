# SPDX-License-Identifier: MIT OR Apache-2.0
"""The wall that shows best what the calibration changes: both half-scans of it, before and after."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.cells import find_pairs

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.calibrate.cells import Pairs

    Array = NDArray[np.float64]

# Cells of one wall: normals within this cosine, and distances from its plane, m.
COPLANAR, LEVEL = np.cos(np.radians(3.0)), 0.04
# A wall is looked at from a cell on within this distance, m; the section is so thick, m, and so far
# across the wall points are shown, m.
REACH, THICKNESS, DEPTH = 3.0, 0.5, 0.15
# The cells whose halves come closest together are tried, of those with enough points.
N_TRIED, MIN_POINTS = 60, 60
# A wall of more points is no better to look at.
MOST_POINTS = 5000


@dataclass(frozen=True, slots=True)
class WallSection:
    """A section through a wall; half 0 and half 1 are the half-scans.

    Attributes
    ----------
    along, across : two arrays each, before and after: (N,) m, along the wall and out of it
    halves : two arrays (N,), before and after
    gaps : (2,) m, between what the half-scans see, before and after: root mean square over the cells
    """

    along: tuple[Array, Array]
    across: tuple[Array, Array]
    halves: tuple[NDArray[np.int64], NDArray[np.int64]]
    gaps: tuple[float, float]


def best_wall(before: Array, after: Array, halves: NDArray[np.int64], sigma: float) -> WallSection:
    """Choose the wall whose half-scans the calibration brings closest together.

    Parameters
    ----------
    before, after : (N, 3) m, the same points with both calibrations, the motor's frame
    halves : (N,) 0 or 1
    sigma : m, noise of a range
    """
    pairs = find_pairs(after, halves, sigma)
    n = np.bincount(pairs.cell, minlength=len(pairs))
    gaps = [_gaps(points, halves, pairs) for points in (before, after)]
    gained = (np.abs(gaps[0]) - np.abs(gaps[1])) * (n >= MIN_POINTS)
    best, chosen = -np.inf, np.zeros(0, dtype=np.int64)
    for seed in np.argsort(-gained, kind="stable")[:N_TRIED]:
        wall = _wall_of(pairs, int(seed))
        apart = [float(np.sqrt(np.mean(gap[wall] ** 2))) for gap in gaps]
        score = (apart[0] - apart[1]) * np.sqrt(min(int(n[wall].sum()), MOST_POINTS))
        if score > best:
            best, chosen = score, wall
    return _section(before, after, halves, pairs, chosen)


def _wall_of(pairs: Pairs, seed: int) -> NDArray[np.int64]:
    normal, off = pairs.normals[seed], pairs.means - pairs.means[seed]
    same = np.abs(pairs.normals @ normal) > COPLANAR
    same &= (np.abs(off @ normal) < LEVEL) & (np.linalg.norm(off, axis=1) < REACH)
    return np.flatnonzero(same)


def _gaps(points: Array, halves: NDArray[np.int64], pairs: Pairs) -> Array:
    """Return how far apart the halves of each cell are across its plane (C,), m."""
    height = np.einsum(
        "mi,mi->m", points[pairs.index] - pairs.means[pairs.cell], pairs.normals[pairs.cell]
    )
    means = []
    for half in (0, 1):
        mine = (halves[pairs.index] == half).astype(np.float64)
        total = np.maximum(np.bincount(pairs.cell, mine, len(pairs)), 1.0)
        means.append(np.bincount(pairs.cell, mine * height, len(pairs)) / total)
    return np.asarray(means[0] - means[1])


def _section(
    before: Array,
    after: Array,
    halves: NDArray[np.int64],
    pairs: Pairs,
    wall: NDArray[np.int64],
) -> WallSection:
    middle = pairs.means[wall].mean(axis=0)
    normal = pairs.normals[wall[0]]
    in_wall = np.isin(pairs.cell, wall)
    mine = pairs.index[in_wall]
    off = after[mine] - middle
    _, axes = np.linalg.eigh(off.T @ off)
    normal = axes[:, 0] * np.sign(axes[:, 0] @ normal)
    # Along the longer side of the wall; the section is cut from the shorter one.
    along, beside = axes[:, 2], axes[:, 1]
    shown = []
    for points in (before, after):
        off = points - middle
        near = (np.abs(off @ beside) < THICKNESS / 2) & (np.abs(off @ normal) < DEPTH)
        near &= np.abs(off @ along) < REACH
        level = float(np.median(off[near] @ normal)) if near.any() else 0.0
        shown.append((off[near] @ along, off[near] @ normal - level, halves[near]))
    rms = [float(np.sqrt(np.mean(_gaps(p, halves, pairs)[wall] ** 2))) for p in (before, after)]
    (x0, y0, half0), (x1, y1, half1) = shown
    return WallSection((x0, x1), (y0, y1), (half0, half1), (rms[0], rms[1]))
