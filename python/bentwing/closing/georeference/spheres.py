# SPDX-License-Identifier: MIT OR Apache-2.0
"""Marks that are spheres of a known radius: where their centres are in the map.

A sphere is found among what else is around it as the shell of its radius with the most points on it and
the fewest within it and just outside it: a wall that touches such a shell goes on beside it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.georeference.control_points import MIN_SIGMA

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FEWEST = 50
"""Points of a sphere; fewer returns between two surfaces can look like one."""
BESIDE = 2.0
"""Radii from the centre, up to which a sphere stands free."""
_ON, _WITHIN, _OUTSIDE = (
    0.25,
    0.5,
    (1.5, 2.0),
)  # of the radius: what is on a shell, in it, beside it
_OTHER = 0.2  # of the radius
_TRIALS, _BEST = 600, 12
_SEARCHED = 2500  # points that the search looks at
_STEPS = 30
_TRIMMED = 3.0
_LEAST_SCATTER = 0.002  # m
_NEAR = 1e-6  # m
_WORST = 0.02  # m; a centre that is known worse is no mark


@dataclass(frozen=True, slots=True)
class Sphere:
    """A sphere that was found.

    Attributes
    ----------
    middle : (3,) m, its centre
    axes, sigmas : (3, 3) unit rows and (3,) m, along which its errors are independent, and how large
    thickness : m, by which its points scatter about it
    n_points : of them
    time : s, of most of them
    """

    middle: Array
    axes: Array
    sigmas: Array
    thickness: float
    n_points: int
    time: float


def sphere_around(
    points: Array, times: Array, mark: Array, radius: float, slack: float
) -> Sphere | None:
    """Find the sphere of a radius nearest to what is expected; None where there is none.

    Parameters
    ----------
    points : (N, 3) m
    times : (N,) s
    mark : (3,) m, where its centre is expected, in the same frame
    radius : m
    slack : m, by which it may be elsewhere
    """
    near = np.linalg.norm(points - mark, axis=1) < slack + BESIDE * radius
    points, times = points[near], times[near]
    if len(points) < FEWEST:
        return None
    few = points[:: len(points) // _SEARCHED + 1]
    tried = _through_three(few, radius)
    tried = tried[np.linalg.norm(tried - mark, axis=1) < slack]
    if not len(tried):
        return None
    best = tried[np.argsort(-_score(few, tried, radius))[:_BEST]]
    centres = np.array([_fitted(few, centre, radius)[0] for centre in best])
    centre, scatter = _fitted(points, centres[_score(few, centres, radius).argmax()], radius)
    gaps = points - centre
    lengths = np.linalg.norm(gaps, axis=1)
    on = np.abs(lengths - radius) < _TRIMMED * scatter
    n, stray = np.count_nonzero(on), _stray(lengths, radius)
    if n < FEWEST or stray > n / 2 or not np.linalg.norm(centre - mark) < slack:
        return None
    normals = gaps[on] / lengths[on, None]
    # What fits better with another radius is something else.
    grown = np.linalg.lstsq(np.c_[normals, np.ones(n)], lengths[on] - radius, rcond=None)[0][3]
    if abs(grown) > _OTHER * radius:
        return None
    information = normals.T @ normals / scatter**2
    values, vectors = np.linalg.eigh(information)
    if not values[0] > _WORST**-2:
        return None
    sigmas = np.hypot(values**-0.5, MIN_SIGMA)
    return Sphere(centre, vectors.T, sigmas, scatter, int(n), float(np.median(times[on])))


def _through_three(points: Array, radius: float) -> Array:
    """Centres (K, 3) of spheres through a point and two near it, drawn anew each time."""
    rng = np.random.default_rng(0)
    found = []
    for first in rng.integers(0, len(points), _TRIALS):
        gaps = points - points[first]
        near = np.flatnonzero(np.einsum("ni,ni->n", gaps, gaps) < (1.5 * radius) ** 2)
        a, b = gaps[rng.choice(near, 2)]
        # from a corner of the triangle to the centre of its circle, and from there to both sides
        normal = np.cross(a, b)
        squared = float(normal @ normal)  # of twice its area
        if squared < (0.05 * radius**2) ** 2:
            continue
        middle = np.cross(a @ a * b - b @ b * a, normal) / (2 * squared)
        up = radius**2 - float(middle @ middle)
        if up <= 0:
            continue
        aside = np.sqrt(up / squared) * normal
        found += [points[first] + middle + aside, points[first] + middle - aside]
    return np.array(found).reshape(-1, 3)


def _score(points: Array, centres: Array, radius: float) -> NDArray[np.int64]:
    """Count the points (K,) on each shell less those in it and beside it."""
    scores = []
    for centre in centres:
        lengths = np.linalg.norm(points - centre, axis=1)
        on = np.count_nonzero(np.abs(lengths - radius) < _ON * radius)
        scores.append(on - _stray(lengths, radius))
    return np.array(scores)


def _stray(lengths: Array, radius: float) -> int:
    """Count the points, at such distances from a centre, that a sphere that stands free does not have."""
    shares = lengths / radius
    beside = (shares > _OUTSIDE[0]) & (shares < _OUTSIDE[1])
    return int(np.count_nonzero((shares < _WITHIN) | beside))


def _fitted(points: Array, centre: Array, radius: float) -> tuple[Array, float]:
    """Fit a centre to the points about its shell, and return it with their scatter, m.

    The scatter is that of the median, and only what is within three of it counts at last, so that the
    post and returns from two surfaces do not.
    """
    limit = _ON * radius
    scatter = limit / _TRIMMED
    for _ in range(_STEPS):
        gaps = points - centre
        lengths = np.linalg.norm(gaps, axis=1)
        off = lengths - radius
        on = np.abs(off) < limit
        if np.count_nonzero(on) < FEWEST:
            break
        normals = gaps[on] / lengths[on, None]
        step = np.linalg.lstsq(normals, off[on], rcond=None)[0]
        centre = centre + step
        scatter = max(1.4826 * float(np.median(np.abs(off[on]))), _LEAST_SCATTER)
        limit = min(_TRIMMED * scatter, 2 * _ON * radius)
        if np.abs(step).max() < _NEAR:
            break
    return centre, scatter
