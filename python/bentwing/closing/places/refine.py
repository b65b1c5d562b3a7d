# SPDX-License-Identifier: MIT OR Apache-2.0
"""Iterative closest surfels: the transform that brings two places together best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from bentwing.base.transform import apply, turned_and_shifted
from bentwing.closing.places.cloud import opposed

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

    from bentwing.closing.places.cloud import Surfels

SIGMA = 0.03
"""m, isotropic, added to the surfels' own extents: noise, drift, and what sampling does."""
_ENOUGH_PAIRS = 20
_ENOUGH = 1e-4  # rad and m, a smaller step ends it


@dataclass(frozen=True, slots=True)
class Schedule:
    """How an alignment proceeds.

    Attributes
    ----------
    gates : m, of the iterations: surfels farther apart are no pairs
    n_upright : iterations with four degrees of freedom, before six
    most : surfels of b that are aligned
    sigma : m, isotropic, added to the surfels' own extents
    kernel : standard deviations at which Cauchy's weight is one half
    """

    gates: tuple[float, ...]
    n_upright: int
    most: int
    sigma: float
    kernel: float


COARSE = Schedule((1.5, 1.5, 1.5, 1.0, 1.0, 0.7, 0.7, 0.5, 0.5), 4, 700, SIGMA, 2.0)
FINE = Schedule((0.5,) * 5 + (0.4,) * 10, 0, 2000, 0.015, 1.5)


@dataclass(frozen=True, slots=True)
class Alignment:
    """Two places brought together.

    Attributes
    ----------
    T_a_b : (4, 4)
    information : (6, 6) of a perturbation on the left about `about`, rotation first, all surfels
        taken for independent
    about : (3,) m, map frame of a
    n_pairs : surfels that took part
    """

    INDEPENDENT: ClassVar[float] = 0.05
    """Share of the surfels that err by themselves: neighbours on one surface err alike."""

    T_a_b: NDArray[np.float64]
    information: NDArray[np.float64]
    about: NDArray[np.float64]
    n_pairs: int


def refine(
    a: Surfels, tree: cKDTree, b: Surfels, T_a_b: NDArray[np.float64], schedule: Schedule
) -> Alignment | None:
    """Align the surfels of b with those of a.

    Distances are measured by the covariances of both surfels: along a plane they are free, across
    it they are sharp. None where too few surfels are near each other.

    Parameters
    ----------
    a, b : surfels of the places
    tree : of a's means
    T_a_b : (4, 4) to begin with
    schedule : `COARSE` for a guess, `FINE` for what is nearly right

    References
    ----------
    Segal et al. 2009, Generalized-ICP.
    """
    step = -(-len(b) // schedule.most) or 1
    b = b[::step]
    means, covariances = b.means, b.covariances
    for iteration, gate in enumerate(schedule.gates):
        R = T_a_b[:3, :3]
        moved = apply(T_a_b, means)
        distances, nearest = tree.query(moved, distance_upper_bound=gate)
        near = np.isfinite(distances)
        near[near] = ~opposed(a[nearest[near]], b[near], R)
        if near.sum() < _ENOUGH_PAIRS:
            return None
        rows, columns = np.flatnonzero(near), nearest[near]
        residuals = moved[rows] - a.means[columns]
        spread = (
            a.covariances[columns] + R @ covariances[rows] @ R.T + schedule.sigma**2 * np.eye(3)
        )
        weights = np.linalg.inv(spread)
        chi2 = np.einsum("ni,nij,nj->n", residuals, weights, residuals)
        # Cauchy; a kernel wide at first, when hardly any surfel is where it should be
        kernel = max(schedule.kernel, 0.5 * float(np.sqrt(np.median(chi2))))
        weights = weights / (1.0 + chi2 / kernel**2)[:, None, None]
        about = moved[rows].mean(axis=0)
        J = _jacobians(moved[rows] - about)
        WJ = weights @ J
        information = np.einsum("nki,nkj->ij", J, WJ)
        gradient = np.einsum("nki,nk->i", WJ, residuals)
        free = np.array([2, 3, 4, 5]) if iteration < schedule.n_upright else np.arange(6)
        delta = np.zeros(6)
        damped = information[np.ix_(free, free)]
        damped = damped + 1e-9 * np.trace(damped) * np.eye(len(free))
        delta[free] = -np.linalg.solve(damped, gradient[free])
        T_a_b = turned_and_shifted(T_a_b, delta, about)
        if iteration >= schedule.n_upright and np.abs(delta).max() < _ENOUGH:
            break
    return Alignment(T_a_b, information, about, int(near.sum()))


def _jacobians(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return derivatives (N, 3, 6) of moved points by a turn about the origin of `arms` and a shift."""
    J = np.zeros((len(arms), 3, 6))
    x, y, z = arms.T
    J[:, 0, 1], J[:, 0, 2] = z, -y
    J[:, 1, 0], J[:, 1, 2] = -z, x
    J[:, 2, 0], J[:, 2, 1] = y, -x
    J[:, :, 3:] = np.eye(3)
    return J
