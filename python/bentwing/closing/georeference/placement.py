# SPDX-License-Identifier: MIT OR Apache-2.0
"""Heading and place of a level map: four degrees of freedom from positions, some of them false.

Gravity is known to the estimators far better than fixes could tell it, so the map is not tilted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import NotEnoughDataError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

GATE = 16.27  # of three squared residuals in units of their noise; 0.1 % are beyond
# Errors of fixes last: those within so many seconds are worth one.
INDEPENDENT = 20.0
MEDIAN = 2.366  # of the same
_N_PAIRS = 300
_ITERATIONS = 30
_CONVERGED = 1e-9


@dataclass(frozen=True, slots=True)
class Placement:
    """`x ↦ Rot(z, heading) x + translation`, from the map to east, north and up.

    Attributes
    ----------
    heading : rad, by which the map's x axis lies north of east
    translation : (3,) m
    std : (4,) standard deviations of heading (rad) and translation (m)
    """

    heading: float
    translation: Array
    std: Array

    @property
    def rotation(self) -> Array:
        """(3, 3)."""
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def std_record(self) -> dict[str, Any]:
        """Return the standard deviations as run.json has them."""
        return {"heading": float(self.std[0]), "translation": self.std[1:]}

    def to_level(self, points: Array) -> Array:
        """East, north, up (N, 3) of map points (N, 3)."""
        level: Array = points @ self.rotation.T + self.translation
        return level

    def to_map(self, points: Array) -> Array:
        """Map points (N, 3) of east, north, up (N, 3)."""
        local: Array = np.asarray((points - self.translation) @ self.rotation)
        return local


@dataclass(frozen=True, slots=True)
class Positions:
    """Points of the map whose place is measured.

    Attributes
    ----------
    points : (N, 3) m, map frame
    targets : (N, 3) m, east, north, up
    covariances : (N, 3, 3) m², of each
    share : of its information that each has, where the errors of several are the same
    """

    points: Array
    targets: Array
    covariances: Array
    share: float = 1.0

    @property
    def information(self) -> Array:
        """(N, 3, 3) 1/m², what each adds to the others."""
        return np.asarray(self.share * np.linalg.inv(self.covariances), np.float64)


def independent_share(times: Array) -> float:
    """Return how much of an independent measurement each of many fixes at times (N,) s is."""
    spacing = float(np.median(np.diff(times))) if len(times) > 1 else INDEPENDENT
    return min(1.0, spacing / INDEPENDENT)


@dataclass(frozen=True, slots=True)
class Surfaces:
    """Surfaces of the map that should pass through surveyed points.

    Attributes
    ----------
    points, normals : (K, 3) m, map frame
    targets : (K, 3) m, east, north, up
    sigmas : (K,) m, across the surface
    """

    points: Array
    normals: Array
    targets: Array
    sigmas: Array

    @classmethod
    def none(cls) -> Surfaces:
        """Return no surfaces."""
        empty = np.empty((0, 3))
        return cls(empty, empty, empty, np.empty(0))

    def offsets(self, placement: Placement) -> Array:
        """Signed distances (K,) m of the surfaces from the targets, along the normals."""
        gaps = placement.to_level(self.points) - self.targets
        offsets: Array = np.einsum("ki,ki->k", self.normals @ placement.rotation.T, gaps)
        return offsets


def place(
    positions: Positions, surfaces: Surfaces, start: Placement | None = None
) -> tuple[Placement, NDArray[np.bool_]]:
    """Fit heading and place.

    Parameters
    ----------
    positions : any share below one half may be false
    surfaces : all true
    start : default: from the positions

    Returns
    -------
    placement
    used : (N,) bool, the positions within the gate

    Raises
    ------
    NotEnoughDataError
        If heading and place do not follow from the data.
    """
    found = start or _from_pairs(positions)
    used = np.ones(len(positions.points), dtype=np.bool_)
    scale = 1.0
    for _ in range(_ITERATIONS):
        squared = _squared_residuals(positions, found)
        if len(squared):
            # Receivers are often too sure of themselves; never believe them more than they ask.
            scale = max(1.0, float(np.median(squared)) / MEDIAN)
            used = squared < GATE * scale
        step, covariance = _step(positions, used, scale, surfaces, found)
        found = Placement(
            float(np.angle(np.exp(1j * (found.heading + step[0])))),
            found.translation + step[1:],
            np.sqrt(np.diag(covariance)),
        )
        if np.abs(step).max() < _CONVERGED:
            break
    return found, used


def _from_pairs(positions: Positions) -> Placement:
    """Start from the pair of distant positions that most others agree with."""
    n = len(positions.points)
    if n < 2:
        msg = (
            f"{n} usable GNSS fixes say nothing about the heading of the map; at least 2 are needed"
        )
        raise NotEnoughDataError(msg)
    pairs = np.random.default_rng(0).integers(0, n, (_N_PAIRS, 2))
    spans = np.linalg.norm(np.diff(positions.points[pairs][..., :2], axis=1), axis=(1, 2))
    best: tuple[float, Placement] | None = None
    for i, j in pairs[spans >= np.median(spans)].tolist():
        way = positions.points[j] - positions.points[i]
        goal = positions.targets[j] - positions.targets[i]
        heading = float(np.arctan2(goal[1], goal[0]) - np.arctan2(way[1], way[0]))
        turned = Placement(heading, np.zeros(3), np.zeros(4))
        shift = np.median(positions.targets - turned.to_level(positions.points), axis=0)
        tried = Placement(heading, shift, np.zeros(4))
        misfit = float(np.median(_squared_residuals(positions, tried)))
        if best is None or misfit < best[0]:
            best = misfit, tried
    if best is None:
        msg = "all GNSS fixes are at one position; they do not determine the heading of the map"
        raise NotEnoughDataError(msg)
    return best[1]


def _squared_residuals(positions: Positions, placement: Placement) -> Array:
    gaps = placement.to_level(positions.points) - positions.targets
    if not len(gaps):
        return np.empty(0)
    weighted = np.linalg.solve(positions.covariances, gaps[..., None])[..., 0]
    squared: Array = np.einsum("ni,ni->n", gaps, weighted)
    return squared


def _step(
    positions: Positions,
    used: NDArray[np.bool_],
    scale: float,
    surfaces: Surfaces,
    at: Placement,
) -> tuple[Array, Array]:
    """One step of Gauss and Newton, [heading, translation], and the covariance."""
    information, right = np.zeros((4, 4)), np.zeros(4)
    up = np.array([0.0, 0.0, 1.0])
    if used.any():
        points = positions.points[used] @ at.rotation.T
        gaps = points + at.translation - positions.targets[used]
        rows = np.zeros((len(points), 3, 4))
        rows[:, :, 0] = np.cross(up, points)
        rows[:, :, 1:] = np.eye(3)
        weights = positions.information[used] / scale
        information += np.einsum("nia,nij,njb->ab", rows, weights, rows)
        right -= np.einsum("nia,nij,nj->a", rows, weights, gaps)
    if len(surfaces.sigmas):
        normals, points = surfaces.normals @ at.rotation.T, surfaces.points @ at.rotation.T
        gaps = points + at.translation - surfaces.targets
        turning = np.einsum("ki,ki->k", np.cross(up, normals), gaps)
        turning += np.einsum("ki,ki->k", normals, np.cross(up, points))
        lines = np.c_[turning, normals] / surfaces.sigmas[:, None]
        information += lines.T @ lines
        right -= lines.T @ (surfaces.offsets(at) / surfaces.sigmas)
    # In units of 1 rad and 1 m both are of the same order, so the condition means something.
    if not np.linalg.cond(information) < 1e12:
        msg = "heading and place of the map do not follow from the GNSS fixes and control points"
        raise NotEnoughDataError(msg)
    covariance: Array = np.asarray(np.linalg.inv(information), np.float64)
    return covariance @ right, covariance
