# SPDX-License-Identifier: MIT OR Apache-2.0
"""Lines put together: those that go on in each other, and those that meet in a corner."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

_SAME = np.sin(np.radians(2.0))  # between directions of one wall
_BESIDE = 0.02  # m from one line to the ends of the other, where both are one wall
_APART = 0.25  # m between the ends of parts of one wall; a door is wider
_CROSSING = np.sin(np.radians(20.0))  # between directions, from which on lines meet
_REACH = 0.15  # m from the end of a line to a corner


def merge_collinear(lines: Array) -> Array:
    """Return lines (K, 2, 2) m, longest first, of which none goes on in another."""
    left = sorted(lines, key=_length, reverse=True)
    merged: list[Array] = []
    while left:
        line = left.pop(0)
        at = next((i for i, other in enumerate(left) if _goes_on(line, other)), None)
        if at is None:
            merged.append(line)
            continue
        left.append(_together(line, left.pop(at)))
        left.sort(key=_length, reverse=True)
    return np.array(merged).reshape(-1, 2, 2)


def join_corners(lines: Array) -> Array:
    """Return lines (K, 2, 2) m whose ends lie where they meet others.

    An end within 15 cm of another line's course goes to where the two cross, where that lies on the
    other line or as near to its end; of several crossings to the nearest.
    """
    joined = lines.copy()
    pairs = [(i, j) for i in range(len(lines)) for j in range(i) if _are_near(lines[i], lines[j])]
    nearest = np.full((len(lines), 2), _REACH)
    for i, j in pairs:
        corner = _crossing(lines[i], lines[j])
        if corner is None or max(_beyond(lines[i], corner), _beyond(lines[j], corner)) > _REACH:
            continue
        for k in (i, j):
            distances = np.linalg.norm(lines[k] - corner, axis=1)
            end = int(np.argmin(distances))
            if distances[end] < nearest[k, end]:
                nearest[k, end] = distances[end]
                joined[k, end] = corner
    return joined


def _length(line: Array) -> float:
    return float(np.linalg.norm(line[1] - line[0]))


def _direction(line: Array) -> Array:
    unit: Array = (line[1] - line[0]) / max(_length(line), 1e-9)
    return unit


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _goes_on(line: Array, other: Array) -> bool:
    along = _direction(line)
    if abs(_cross(along, _direction(other))) > max(_SAME, _BESIDE / max(_length(other), 1e-9)):
        return False
    local = other - line[0]
    if max(abs(_cross(along, local[0])), abs(_cross(along, local[1]))) > _BESIDE:
        return False
    shares = local @ along
    return bool(shares.max() > -_APART and shares.min() < _length(line) + _APART)


def _together(line: Array, other: Array) -> Array:
    """Return the line through both, each with the weight of its length."""
    ends = np.concatenate([line, other])
    weights = np.repeat([_length(line), _length(other)], 2)
    centre = np.average(ends, axis=0, weights=weights)
    local = ends - centre
    _, axes = np.linalg.eigh((local * weights[:, None]).T @ local)
    shares = local @ axes[:, 1]
    united: Array = centre + np.array([[shares.min()], [shares.max()]]) * axes[:, 1]
    return united


def _are_near(line: Array, other: Array) -> bool:
    low, high = line.min(axis=0) - _REACH, line.max(axis=0) + _REACH
    return bool((other.max(axis=0) >= low).all() and (other.min(axis=0) <= high).all())


def _crossing(line: Array, other: Array) -> Array | None:
    """Return where two lines, gone on with, cross; None where they are almost parallel."""
    along, across = _direction(line), _direction(other)
    turn = _cross(along, across)
    if abs(turn) < _CROSSING:
        return None
    crossing: Array = line[0] + _cross(other[0] - line[0], across) / turn * along
    return crossing


def _beyond(line: Array, point: Array) -> float:
    """Return how far a point on the course of a line is beyond its ends, m."""
    share = float((point - line[0]) @ _direction(line))
    return max(-share, share - _length(line), 0.0)
