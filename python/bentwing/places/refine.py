# SPDX-License-Identifier: MIT OR Apache-2.0
"""Iterative closest surfels: the transform that brings two places together best."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.places.transform import apply, turned_and_shifted

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.places.cloud import Surfels

_GATES = (1.5, 1.5, 1.5, 1.0, 1.0, 0.7, 0.7, 0.5, 0.5, 0.5, 0.5, 0.5)  # m, of the iterations
SIGMA = 0.03  # m, isotropic, added to the surfels' own: noise, drift, and what sampling does
_KERNEL = 2.0  # standard deviations at which Cauchy's weight is one half
_MOST = 1500  # surfels of b that are aligned
_UPRIGHT_UNTIL = 4  # iterations with four degrees of freedom
_ENOUGH = 1e-4  # rad and m, a smaller step ends it


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

    T_a_b: NDArray[np.float64]
    information: NDArray[np.float64]
    about: NDArray[np.float64]
    n_pairs: int


def refine(
    a: Surfels, tree: cKDTree, b: Surfels, T_a_b: NDArray[np.float64]
) -> Alignment | None:
    """Align the surfels of b with those of a, first upright, then in six degrees of freedom.

    Distances are measured by the covariances of both surfels: along a plane they are free, across
    it they are sharp. None where too few surfels are near each other.

    Parameters
    ----------
    a, b : surfels of the places
    tree : of a's means
    T_a_b : (4, 4) to begin with

    References
    ----------
    Segal et al. 2009, Generalized-ICP.
    """
    step = -(-len(b) // _MOST) or 1
    means, covariances = b.means[::step], b.covariances[::step]
    for iteration, gate in enumerate(_GATES):
        R = T_a_b[:3, :3]
        moved = apply(T_a_b, means)
        distances, nearest = tree.query(moved, distance_upper_bound=gate)
        near = np.isfinite(distances)
        if near.sum() < 20:
            return None
        rows, columns = np.flatnonzero(near), nearest[near]
        residuals = moved[rows] - a.means[columns]
        spread = a.covariances[columns] + R @ covariances[rows] @ R.T + SIGMA**2 * np.eye(3)
        weights = np.linalg.inv(spread)
        chi2 = np.einsum("ni,nij,nj->n", residuals, weights, residuals)
        # Cauchy; a kernel wide at first, when hardly any surfel is where it should be
        kernel = max(_KERNEL, 0.5 * float(np.sqrt(np.median(chi2))))
        weights = weights / (1.0 + chi2 / kernel**2)[:, None, None]
        about = moved[rows].mean(axis=0)
        J = _jacobians(moved[rows] - about)
        WJ = weights @ J
        information = np.einsum("nki,nkj->ij", J, WJ)
        gradient = np.einsum("nki,nk->i", WJ, residuals)
        free = np.array([2, 3, 4, 5]) if iteration < _UPRIGHT_UNTIL else np.arange(6)
        delta = np.zeros(6)
        damped = information[np.ix_(free, free)]
        damped = damped + 1e-9 * np.trace(damped) * np.eye(len(free))
        delta[free] = -np.linalg.solve(damped, gradient[free])
        T_a_b = turned_and_shifted(T_a_b, delta, about)
        if iteration >= len(_GATES) - 4 and np.abs(delta).max() < _ENOUGH:
            break
    return Alignment(T_a_b, information, about, int(near.sum()))


def _jacobians(arms: NDArray[np.float64]) -> NDArray[np.float64]:
    """Derivatives (N, 3, 6) of moved points by a turn about the origin of `arms` and a shift."""
    J = np.zeros((len(arms), 3, 6))
    x, y, z = arms.T
    J[:, 0, 1], J[:, 0, 2] = z, -y
    J[:, 1, 0], J[:, 1, 2] = -z, x
    J[:, 2, 0], J[:, 2, 1] = y, -x
    J[:, :, 3:] = np.eye(3)
    return J
