# SPDX-License-Identifier: MIT OR Apache-2.0
"""One linear system of planes, poses and beams; the planes are eliminated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.value import Value

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy import sparse

    from bentwing.closing.beams.cells import Cells
    from bentwing.closing.beams.shots import Shots

    Array = NDArray[np.float64]

KNOT = 0.1
"""s, between the knots of the poses' corrections, which are linear in between."""
N_OFFSETS = 4
"""Of a beam: elevation, azimuth, range, height."""
SIGMAS = np.array([np.radians(0.3), np.radians(0.3), 0.02, 0.1])
"""Prior of a beam: tables of a HDL-64 are off by up to 0.4°, its ranges by 10 to 30 mm."""
FIRST_SIGMAS = np.array([np.radians(0.05), np.radians(0.05), 5e-3, 0.1])
"""What is assumed at first: wider, and the elevations take up what is of another kind."""
LEAST_SIGMAS = np.array([np.radians(0.01), np.radians(0.01), 5e-4, 0.0])
MEAN_SIGMAS = np.array([1e-5, 1e-5, 1e-4, 1e-5])
"""The same of their mean: a turn of all azimuths and a shift of all heights are those of the mount."""
STEP_SIGMA = 5e-4
"""m, of the heights of neighbours, save where a block of lasers ends and another one begins."""
TURN_SIGMA, SHIFT_SIGMA = 0.006, 0.03
"""rad and m, of what a correction departs from a steady one within a knot."""
INDEPENDENT = 200
"""Points of a cell that count as independent."""
FLAT = 1.5
"""Roughness of a cell, in standard deviations of a range, that is noise alone."""
N_BUMPS = 4.0
"""In a cell that is rougher: parts of its surface that are independent."""
LEAST_SLOPE = 0.05
"""Cosine between ray and normal below which a return says nothing of its own range."""


@dataclass(frozen=True, slots=True, eq=False)
class Step(Value):
    """Solution of a system.

    Attributes
    ----------
    poses : (K, 6) `[δr, δt]` of the lidar at the knots, map frame
    beams : (B, 4) elevation and azimuth, rad, range and height, m
    covariance : (4 B, 4 B) of the beams
    """

    poses: Array
    beams: Array
    covariance: Array


def knots_of(times: Array) -> tuple[NDArray[np.intp], Array, int]:
    """Return the knot before each time (N,), the share of the one behind it, and how many there are."""
    at = (times - times[0]) / KNOT
    before = at.astype(np.intp)
    return before, at - before, int(before[-1]) + 2


def solve(shots: Shots, cells: Cells, beams: Array, sigmas: Array, range_sigma: float) -> Step:
    """Move poses and beams so that the points of each cell lie in one plane.

    Parameters
    ----------
    beams : (B, 4) what the beams were corrected by so far; the prior is about none
    sigmas : (4,) standard deviations of the beams, as far as they are known
    range_sigma : m, of a return
    """
    rows, n_knots = _rows(shots, cells, len(beams))
    n_poses, n_beams = 6 * n_knots, len(beams)
    H, g = _without_planes(rows, _weights(cells, range_sigma), cells)
    H += _steady(n_knots, H.shape[0])
    prior = _prior(beams, sigmas)
    H[n_poses:, n_poses:] += prior
    g[n_poses:] += prior @ beams.ravel()
    # The first pose stays.
    H[range(6), range(6)] += 1e10
    poses, offsets, covariance = _solved(H, g, n_poses)
    return Step(poses.reshape(n_knots, 6), offsets.reshape(n_beams, N_OFFSETS), covariance)


def _weights(cells: Cells, range_sigma: float) -> Array:
    """Return how much each return counts, 1/m².

    Noise is another one with each return; the bumps of a surface are the same ones for all. Taken for
    noise they would make what the beams seem to be off many times too certain: in a cave, that all
    begin centimetres higher and lower than they do.
    """
    sigma = np.maximum(range_sigma, cells.roughness)
    counts = np.bincount(cells.cells, minlength=cells.n_cells)[cells.cells]
    bumps = np.maximum(cells.roughness**2 - (FLAT * range_sigma) ** 2, 0.0)
    weights = np.minimum(1.0, INDEPENDENT / counts)
    weights /= range_sigma**2 + bumps * np.maximum(counts / N_BUMPS, 1.0)
    weights /= 1.0 + (cells.across / (2.0 * sigma)) ** 2
    return np.asarray(weights)


def _solved(H: Array, g: Array, n_poses: int) -> tuple[Array, Array, Array]:
    """Return poses and beams that solve `H x = -g`, and the covariance of the beams."""
    from scipy import linalg

    of_poses, mixed = H[:n_poses, :n_poses], H[:n_poses, n_poses:]
    factor = linalg.cho_factor(of_poses, lower=True)
    known = linalg.cho_solve(factor, np.column_stack([mixed, g[:n_poses]]))
    condensed = H[n_poses:, n_poses:] - mixed.T @ known[:, :-1]
    covariance = np.asarray(np.linalg.inv(condensed), dtype=np.float64)
    beams = -covariance @ (g[n_poses:] - mixed.T @ known[:, -1])
    return -known[:, -1] - known[:, :-1] @ beams, beams, covariance


def _rows(shots: Shots, cells: Cells, n_beams: int) -> tuple[sparse.csr_matrix, int]:
    """Return the derivatives of `across` by all states, and the number of knots.

    Those by the beams are taken where the return would be in the plane. Taken where it is they would
    hold its noise, and all would agree that a flatter world has less of it.
    """
    from scipy import sparse

    before, shares, n_knots = knots_of(shots.times)
    n, at = cells.normals, cells.chosen
    rise, turn, ray, up = (slope[at] for slope in shots.slopes())
    cosine = (n * ray).sum(axis=1)
    seen = np.abs(cosine) > LEAST_SLOPE
    in_plane = (
        1.0 - np.where(seen, cells.across / np.where(seen, cosine, 1.0), 0.0) / shots.ranges[at]
    )
    lever = shots.ranges[at, None] * ray
    pose = np.hstack([np.cross(lever, n), n])
    j, s = before[at], shares[at, None]
    values = np.hstack(
        [
            (1.0 - s) * pose,
            s * pose,
            (in_plane * (n * rise).sum(axis=1))[:, None],
            (in_plane * (n * turn).sum(axis=1))[:, None],
            cosine[:, None],
            (n * up).sum(axis=1)[:, None],
        ]
    )
    poses = 6 * j[:, None] + np.arange(12)
    beams = 6 * n_knots + N_OFFSETS * shots.rings[at, None] + np.arange(N_OFFSETS)
    columns = np.hstack([poses, beams])
    starts = np.arange(0, columns.size + 1, columns.shape[1])
    shape = (len(at), 6 * n_knots + N_OFFSETS * n_beams)
    return sparse.csr_matrix((values.ravel(), columns.ravel(), starts), shape=shape), n_knots


def _without_planes(rows: sparse.csr_matrix, weights: Array, cells: Cells) -> tuple[Array, Array]:
    """Return the normal equations of poses and beams, height and slopes of each plane eliminated."""
    from scipy import sparse

    n, roots = len(weights), np.sqrt(weights)
    values = rows.data.reshape(n, -1) * roots[:, None]
    scaled = sparse.csr_matrix((values.ravel(), rows.indices, rows.indptr), shape=rows.shape)
    planes = roots[:, None] * np.column_stack([np.ones(n), cells.along])
    order = np.argsort(cells.cells, kind="stable")
    starts = np.searchsorted(cells.cells[order], np.arange(cells.n_cells))
    own = np.add.reduceat((planes[:, :, None] * planes[:, None, :])[order], starts, axis=0)
    # Columns of a length of one each, which are normal to each other: to eliminate them is a product
    # of a matrix with itself.
    inverse = np.linalg.inv(np.linalg.cholesky(own))
    basis = np.einsum("nij,nj->ni", inverse[cells.cells], planes)
    columns = 3 * cells.cells[:, None] + np.arange(3)
    of_cells = sparse.csr_matrix(
        (basis.ravel(), columns.ravel(), np.arange(0, 3 * n + 1, 3)), shape=(n, 3 * cells.n_cells)
    )
    transposed = scaled.T.tocsr()
    mixed = (transposed @ of_cells).toarray()
    H = (transposed @ scaled).toarray()
    H -= mixed @ mixed.T
    across = roots * cells.across
    g = transposed @ across - mixed @ (of_cells.T @ across)
    return H, np.asarray(g)


def _prior(beams: Array, sigmas: Array) -> Array:
    """Information on the beams: none is far off, and neighbours begin at one height.

    The lasers of a block share a lens, blocks do not: few differences of the heights are large, and
    those are believed, as by a Cauchy distribution.
    """
    n = len(beams)
    information = np.diag(np.tile(sigmas**-2, n))
    means = np.diag(MEAN_SIGMAS**-2) / n**2
    information += np.kron(np.ones((n, n)), means)
    difference = np.diff(np.eye(n), axis=0)
    steps = (difference @ beams[:, 3]) / STEP_SIGMA
    weights = STEP_SIGMA**-2 / (1.0 + steps**2)
    information[3::N_OFFSETS, 3::N_OFFSETS] += difference.T @ (weights[:, None] * difference)
    return information


def shown_sigmas(beams: Array, covariance: Array) -> Array:
    """Return how far beams (B, 4) are off in the mean: no farther than they show themselves to be.

    What no motion shows, such as all elevations alike or in proportion, then stays as small as it is by
    chance with so many beams.
    """
    variances = np.diag(covariance).reshape(beams.shape)
    shown = np.sqrt((beams**2 + variances).mean(axis=0))
    return np.append(np.clip(shown, LEAST_SIGMAS, SIGMAS)[:3], SIGMAS[3])


def _steady(n_knots: int, size: int) -> Array:
    """Information of second differences of the poses' corrections, which are hardly ever large."""
    H = np.zeros((size, size))
    difference = np.zeros((max(n_knots - 2, 0), n_knots))
    for shift, value in enumerate((1.0, -2.0, 1.0)):
        difference[np.arange(len(difference)), np.arange(len(difference)) + shift] = value
    product = difference.T @ difference
    for c in range(6):
        sigma = TURN_SIGMA if c < 3 else SHIFT_SIGMA
        H[c : 6 * n_knots : 6, c : 6 * n_knots : 6] = product / sigma**2
    return H
