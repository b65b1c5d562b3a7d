# SPDX-License-Identifier: MIT OR Apache-2.0
"""Straight lines through the points of a section: the walls of a plan.

A line grows from where points lie along one direction, as far as they go on without a gap. Points that
a line has taken are no other line's, so that the two faces of a wall stay two lines.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.arguments import finite_array
from bentwing.base.moments import VoxelMoments
from bentwing.products.corners import join_corners, merge_collinear

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]

SHORTEST = 0.3
"""m, of a line."""
_LEVELS = (
    1.0,
    3.0,
)  # of coarseness, which multiply the next four: dense walls first, then sparse ones
_SEED = 0.1  # m, edge of the cells in which directions are looked for
_BIN = 0.05  # m along a line
_GAP = 4  # empty bins that end a line, at first, and m that end it at any level: less than a door
_WIDEST_GAP = 0.45
_WIDEST = 0.04  # m from a line to its points
_NARROWEST = 0.015  # m
_SIGMAS = 2.5  # from a line to its points
_THICKEST = 0.025  # m, standard deviation of the points of a line
_RIDGE = 0.2  # share of the points around that lie along a line, 3 cm wide, where one begins
_TRIED = 0.5  # share of the points around a beginning that such lines have had
_FILLED = 0.8  # of the bins of a line, at least
_CONTRAST = 4.0  # of the density on a line to that beside it, on the emptier side
_CROWDED = (
    4.0  # points on a line by those beside it on the fuller side; where they are everywhere, 2
)
_BEND = (
    0.04  # height of the arc by its length; a circle's is larger where it is long enough to tell
)
_FEWEST = 20  # points
_ROUNDS = 40


@dataclass(frozen=True, slots=True)
class _Line:
    """A line that grows: a point on it, its direction, and how far it goes to both sides."""

    centre: Array
    direction: Array
    first: float
    last: float
    width: float
    level: float

    @property
    def normal(self) -> Array:
        return np.array([-self.direction[1], self.direction[0]])

    @property
    def bin(self) -> float:
        return _BIN * self.level

    @property
    def gap(self) -> float:
        return min(_GAP * self.bin, _WIDEST_GAP)

    def ends(self) -> Array:
        return self.centre + np.array([[self.first], [self.last]]) * self.direction


def fit_lines(points: ArrayLike, weights: ArrayLike | None = None) -> NDArray[np.float64]:
    """Find straight lines in a cloud of two dimensions.

    Parameters
    ----------
    points : (N, 2) m
    weights : (N,) how many measurements each stands for; default: one

    Returns
    -------
    (K, 2, 2) m, both ends of each line, longest first. Lines that go on in each other are one, and
    those that meet near their ends end at the same point.

    Raises
    ------
    TypeError, ValueError
        If an array has another shape or is not finite.
    """
    places = finite_array("points", points, None, 2)
    n = np.ones(len(places)) if weights is None else finite_array("weights", weights, len(places))
    if len(places) < 2:
        return np.empty((0, 2, 2))
    lines = _grown(places, n)
    return join_corners(merge_collinear(lines))


def _grown(points: Array, weights: Array) -> Array:
    tree = cKDTree(points)
    free = np.ones(len(points), np.bool_)
    vain = np.zeros(
        len(points), np.bool_
    )  # where a line of this level began or went that is no wall
    found = []
    seeds = ((level, *seed) for level in _LEVELS for seed in _seeds(points, free, level))
    last = 0.0
    for level, centre, direction in seeds:
        if level != last:
            vain[:], last = False, level
        near = np.array(tree.query_ball_point(centre, 2.5 * _SEED * level), np.intp)
        near = near[free[near]]
        if weights[near].sum() < _FEWEST or vain[near].mean() > _TRIED:
            continue
        start = _on_ridge(points[near], weights[near], centre, direction, level)
        line = None if start is None else _grow(tree, points, weights, free, start)
        if line is None:
            continue
        rows = _around(tree, points, line, free)
        local = points[rows] - line.centre
        along, across = local @ line.direction, np.abs(local @ line.normal)
        inside = (along >= line.first) & (along <= line.last)
        if _is_wall(along[inside], (local @ line.normal)[inside], weights[rows][inside], line):
            free[rows[inside & (across <= max(line.width, _NARROWEST * 2))]] = False
            found.append(line.ends())
        else:
            vain[rows[inside]] = True
    return np.array(found).reshape(-1, 2, 2)


def _seeds(points: Array, free: NDArray[np.bool_], level: float) -> Iterator[tuple[Array, Array]]:
    """Yield centre (2,) and direction (2,) of where points lie in a row, the clearest first.

    What is free is looked at when the first of a level is asked for.
    """
    moments = VoxelMoments(_SEED * level)
    moments.add(np.column_stack([points[free], np.zeros(np.count_nonzero(free))]))
    cells = moments.result()
    variances, axes = np.linalg.eigh(cells.covariances[:, :2, :2])
    flatness = np.sqrt(np.maximum(variances[:, 0], 0) / np.maximum(variances[:, 1], 1e-9))
    order = np.argsort(-cells.counts * (1 - flatness), kind="stable")
    yield from zip(cells.means[order, :2], axes[order, :, 1], strict=True)


def _on_ridge(
    points: Array, weights: Array, centre: Array, direction: Array, level: float
) -> _Line | None:
    """Begin a line where most points lie across the direction, not between the faces of a wall.

    None where points lie everywhere, as on a floor.
    """
    normal = np.array([-direction[1], direction[0]])
    offsets = (points - centre) @ normal
    steps = np.rint(offsets / 0.01).astype(np.intp)
    counts = np.convolve(np.bincount(steps - steps.min(), weights), np.ones(3), "same")
    if counts.max() < _RIDGE * weights.sum():
        return None
    ridge = 0.01 * (int(np.argmax(counts)) + steps.min())
    reach = _SEED * level
    return _Line(centre + ridge * normal, direction, -reach, reach, _WIDEST, level)


def _grow(
    tree: cKDTree, points: Array, weights: Array, free: NDArray[np.bool_], line: _Line
) -> _Line | None:
    """Fit and lengthen a line until it stays; None where no points go along it."""
    for _ in range(_ROUNDS):
        rows = _around(tree, points, line, free)
        local = points[rows] - line.centre
        along, across = local @ line.direction, local @ line.normal
        inside = (
            (np.abs(across) <= line.width)
            & (along >= line.first - line.bin)
            & (along <= line.last + line.bin)
        )
        if weights[rows[inside]].sum() < _FEWEST or np.count_nonzero(inside) < 3:
            return None
        fitted = _fit(points[rows[inside]], weights[rows[inside]], line)
        local = points[rows] - fitted.centre
        near = np.abs(local @ fitted.normal) <= fitted.width
        grown = _extent((local @ fitted.direction)[near], fitted)
        if grown is None:
            return None
        settled = abs(grown.first - fitted.first) + abs(grown.last - fitted.last) < 0.5 * line.bin
        line = grown
        if settled:
            return line
    return line


def _around(tree: cKDTree, points: Array, line: _Line, free: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the free points beside a line and a gap beyond its ends."""
    reach = line.gap + 2 * line.bin
    step = 6 * _WIDEST
    along = np.arange(line.first - reach, line.last + reach + step, step)
    middles = line.centre + along[:, None] * line.direction
    lists = tree.query_ball_point(middles, np.hypot(0.5 * step, 3 * _WIDEST))
    near = np.unique(np.concatenate([np.array(rows, np.intp) for rows in lists]))
    beside = np.abs((points[near] - line.centre) @ line.normal) < 3 * _WIDEST
    kept: NDArray[np.intp] = near[free[near] & beside]
    return kept


def _fit(points: Array, weights: Array, line: _Line) -> _Line:
    """Fit a line by total least squares, and keep what it covers."""
    centre = np.average(points, axis=0, weights=weights)
    local = points - centre
    covariance = (local * weights[:, None]).T @ local / weights.sum()
    variances, axes = np.linalg.eigh(covariance)
    direction = axes[:, 1] * (1.0 if axes[:, 1] @ line.direction >= 0 else -1.0)
    width = float(np.clip(_SIGMAS * np.sqrt(max(variances[0], 0.0)), _NARROWEST, _WIDEST))
    first, last = ((line.ends() - centre) @ direction).tolist()
    return replace(line, centre=centre, direction=direction, first=first, last=last, width=width)


def _extent(along: Array, line: _Line) -> _Line | None:
    """Return the line as far as points go on from its middle without a gap."""
    if not len(along):
        return None
    ordered = np.sort(along)
    runs = np.split(ordered, np.flatnonzero(np.diff(ordered) > line.gap) + 1)
    middle = 0.5 * (line.first + line.last)
    run = min(runs, key=lambda r: max(r[0] - middle, middle - r[-1], 0.0))
    return replace(line, first=float(run[0]), last=float(run[-1]))


def _is_wall(along: Array, across: Array, weights: Array, line: _Line) -> bool:
    """Whether points along a line are a straight, thin and filled row that stands out."""
    length = line.last - line.first
    near = np.abs(across) <= line.width
    if length < SHORTEST * line.level or weights[near].sum() < _FEWEST:
        return False
    bins = np.unique(np.floor((along[near] - line.first) / line.bin))
    sigma = np.sqrt(np.average(across[near] ** 2, weights=weights[near]))
    if len(bins) < _FILLED * length / line.bin or sigma > _THICKEST:
        return False
    beside = [
        weights[(side * across > line.width) & (side * across <= 2 * line.width)].sum()
        for side in (-1.0, 1.0)
    ]
    n = weights[near].sum()
    if n < 2 * _CONTRAST * min(beside) or n < _CROWDED * max(beside):
        return False
    return _arc(along[near], across[near], weights[near]) < _BEND * length


def _arc(along: Array, across: Array, weights: Array) -> float:
    """Return how far, m, the middle of a row of points is off the line between its ends."""
    reach = 0.5 * float(np.ptp(along))
    share = (along - along.min()) / max(reach, 1e-9) - 1.0
    columns = np.stack([np.ones_like(share), share, share**2], axis=1)
    root = np.sqrt(weights)[:, None]
    bend, *_ = np.linalg.lstsq(columns * root, across * root[:, 0], rcond=None)
    return float(abs(bend[2]))
