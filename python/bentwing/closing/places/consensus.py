# SPDX-License-Identifier: MIT OR Apache-2.0
"""Random sample consensus: transforms on which many matches of keypoints agree."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.transform import apply, upright
from bentwing.closing.places.gestalt import opposite

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.places.metric import Metric
    from bentwing.closing.places.place import Place

_MATCHES_PER_KEYPOINT = 2
_MOST_MATCHES = 400
_MOST_SAMPLES = 1500
_NEAR = 0.6  # m, between a keypoint and its match, once transformed
_SAME_LENGTH = 0.4  # m, between the two distances of a pair of matches
_BASELINE = 2.0  # m, a shorter one tells no heading
_SAME_HEADING = np.radians(30.0)
_DISTINCT = 1.5  # m
_DISTINCT_HEADING = np.radians(10.0)
_FEWEST = 3  # keypoints in agreement: two always agree
_SEED = 1981


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """An upright transform and how many keypoints agree with it.

    Attributes
    ----------
    T_a_b : (4, 4) rotation about the vertical, and translation
    n_inliers : keypoints of a with a match of theirs in agreement
    """

    T_a_b: NDArray[np.float64]
    n_inliers: int


@dataclass(frozen=True, slots=True)
class _Matches:
    """Points of a and b that look alike, and by how much b is turned against a if they are."""

    rows: NDArray[np.intp]
    points_a: NDArray[np.float64]
    points_b: NDArray[np.float64]
    turns: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.rows)


def hypotheses(a: Place, b: Place, metric: Metric, n: int) -> list[Hypothesis]:
    """Up to `n` distinct transforms from b to a, those with the most keypoints in agreement first.

    Two matches give four degrees of freedom. Samples whose lengths, heights or headings contradict
    each other are left out before they are counted.
    """
    matches = _matches(a, b, metric)
    first, second = _samples(matches)
    if not len(first):
        return []
    yaws, shifts = _transforms(matches, first, second)
    counts = _count(matches, yaws, shifts)
    return [
        _refined(matches, yaws[best], shifts[best])
        for best in _distinct_best(matches, yaws, shifts, counts, n)
    ]


def _matches(a: Place, b: Place, metric: Metric) -> _Matches:
    """Find the keypoints of b most like each of a's, for both signs of the frames."""
    from scipy.spatial.distance import cdist

    theirs = metric.apply(b.descriptors)
    ours = np.concatenate([metric.apply(a.descriptors), metric.apply(opposite(a.descriptors))])
    n = len(a.keypoints)
    if not n or not len(theirs):
        nothing = np.zeros((0, 3))
        return _Matches(np.zeros(0, np.intp), nothing, nothing, np.zeros(0))
    distances = cdist(ours, theirs)
    k = min(_MATCHES_PER_KEYPOINT, len(theirs))
    columns = np.argsort(distances, axis=1, kind="stable")[:, :k].ravel()
    rows = np.repeat(np.arange(2 * n), k)
    order = np.argsort(distances[rows, columns], kind="stable")[:_MOST_MATCHES]
    rows, columns = rows[order], columns[order]
    own = rows % n
    turns = a.keypoints.headings[own] - b.keypoints.headings[columns] + np.pi * (rows >= n)
    return _Matches(own, a.keypoints.points[own], b.keypoints.points[columns], turns)


def _samples(matches: _Matches) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Pairs of matches that do not contradict each other."""
    i, j = np.triu_indices(len(matches), k=1)
    between_a = matches.points_a[j] - matches.points_a[i]
    between_b = matches.points_b[j] - matches.points_b[i]
    length_a, length_b = (np.hypot(d[:, 0], d[:, 1]) for d in (between_a, between_b))
    possible = (
        (np.minimum(length_a, length_b) > _BASELINE)
        & (np.abs(length_a - length_b) < _SAME_LENGTH)
        & (np.abs(between_a[:, 2] - between_b[:, 2]) < _SAME_LENGTH)
        & (np.abs(_wrap(matches.turns[i] - matches.turns[j])) < 2 * _SAME_HEADING)
    )
    i, j = i[possible], j[possible]
    yaw = _yaw_between(between_a[possible], between_b[possible])
    fits = np.maximum(np.abs(_wrap(yaw - matches.turns[i])), np.abs(_wrap(yaw - matches.turns[j])))
    i, j = i[fits < _SAME_HEADING], j[fits < _SAME_HEADING]
    if len(i) > _MOST_SAMPLES:
        chosen = np.random.default_rng(_SEED).choice(len(i), _MOST_SAMPLES, replace=False)
        i, j = i[chosen], j[chosen]
    return i, j


def _transforms(
    matches: _Matches, first: NDArray[np.intp], second: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Yaws (S,) and translations (S, 3) that bring the samples' points together."""
    between_a = matches.points_a[second] - matches.points_a[first]
    between_b = matches.points_b[second] - matches.points_b[first]
    yaws = _yaw_between(between_a, between_b)
    middle_a = 0.5 * (matches.points_a[first] + matches.points_a[second])
    middle_b = 0.5 * (matches.points_b[first] + matches.points_b[second])
    return yaws, middle_a - _turned(yaws, middle_b)


def _count(
    matches: _Matches, yaws: NDArray[np.float64], shifts: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Count for each transform the keypoints of a with a match in agreement."""
    counts = np.zeros(len(yaws), dtype=np.int64)
    order = np.argsort(matches.rows, kind="stable")
    rows = matches.rows[order]
    starts = np.flatnonzero(np.concatenate([[True], rows[1:] != rows[:-1]]))
    points_a, points_b = matches.points_a[order], matches.points_b[order]
    for block in np.array_split(np.arange(len(yaws)), max(1, len(yaws) // 256)):
        c, s = np.cos(yaws[block])[:, None], np.sin(yaws[block])[:, None]
        x, y, z = points_b.T
        dx = c * x - s * y + shifts[block, :1] - points_a[:, 0]
        dy = s * x + c * y + shifts[block, 1:2] - points_a[:, 1]
        dz = z + shifts[block, 2:] - points_a[:, 2]
        near = dx * dx + dy * dy + dz * dz < _NEAR**2
        counts[block] = np.logical_or.reduceat(near, starts, axis=1).sum(axis=1)
    return counts


def _refined(matches: _Matches, yaw: float, shift: NDArray[np.float64]) -> Hypothesis:
    """Least squares over the matches in agreement."""
    T = upright(yaw, shift)
    for _ in range(3):
        moved = apply(T, matches.points_b)
        near = np.linalg.norm(moved - matches.points_a, axis=1) < _NEAR
        a, b = matches.points_a[near], matches.points_b[near]
        if len(a) < 2:
            break
        a0, b0 = a.mean(axis=0), b.mean(axis=0)
        da, db = a - a0, b - b0
        yaw = np.arctan2(
            (db[:, 0] * da[:, 1] - db[:, 1] * da[:, 0]).sum(),
            (db[:, 0] * da[:, 0] + db[:, 1] * da[:, 1]).sum(),
        )
        T = upright(float(yaw), a0 - upright(float(yaw), np.zeros(3))[:3, :3] @ b0)
    moved = apply(T, matches.points_b)
    near = np.linalg.norm(moved - matches.points_a, axis=1) < _NEAR
    return Hypothesis(T, len(set(matches.rows[near].tolist())))


def _distinct_best(
    matches: _Matches,
    yaws: NDArray[np.float64],
    shifts: NDArray[np.float64],
    counts: NDArray[np.int64],
    n: int,
) -> list[int]:
    """Up to `n` transforms, most agreement first, that differ by more than a little in the middle of b."""
    middle = np.median(matches.points_b, axis=0)
    placed = _turned(yaws, np.tile(middle, (len(yaws), 1))) + shifts
    left = counts >= _FEWEST
    order = np.argsort(-counts, kind="stable")
    taken: list[int] = []
    for best in order.tolist():
        if len(taken) == n:
            break
        if left[best]:
            taken.append(best)
            left &= (np.linalg.norm(placed - placed[best], axis=1) > _DISTINCT) | (
                np.abs(_wrap(yaws - yaws[best])) > _DISTINCT_HEADING
            )
    return taken


def _turned(yaws: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.float64]:
    c, s = np.cos(yaws), np.sin(yaws)
    return np.column_stack(
        [c * points[:, 0] - s * points[:, 1], s * points[:, 0] + c * points[:, 1], points[:, 2]]
    )


def _yaw_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angle about the vertical that turns the vectors b to a."""
    return np.arctan2(a[:, 1], a[:, 0]) - np.arctan2(b[:, 1], b[:, 0])


def _wrap(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Angles in [−π, π)."""
    wrapped: NDArray[np.float64] = (angles + np.pi) % (2 * np.pi) - np.pi
    return wrapped
