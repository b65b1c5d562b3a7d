# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a map may lie in a reference of unknown frame: turned about the vertical, and shifted.

Both are upright, as levelled scanners and bentwing's maps are. Pictures from above, bright where
surfaces are high, are compared for all shifts at once by their transforms, heading by heading.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.voxels import column_keys
from bentwing.evaluate.alignment import Alignment

if TYPE_CHECKING:
    from numpy.typing import NDArray

_HEADINGS = 120
_FINEST = 0.5  # m, edge of a cell
_MOST_CELLS = 256  # along an axis of a picture
_LAYER = 0.25  # m; a cell is as bright as the logarithm of its number of filled layers
_CANDIDATES = 8
_APART = 4  # cells between two candidates of one heading


def coarse_placements(
    points: NDArray[np.float64], reference: NDArray[np.float64]
) -> list[Alignment]:
    """Find rigid motions worth a closer look, best first.

    Parameters
    ----------
    points, reference : (N, 3) and (M, 3) m, thinned to an even density
    """
    reach = max(np.ptp(cloud[:, :2], axis=0).max() for cloud in (points, reference))
    cell = max(_FINEST, float(reach) / _MOST_CELLS)
    middle = np.median(points, axis=0)
    target, corner = _picture(reference, cell)
    found: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
    for heading in 2 * np.pi * np.arange(_HEADINGS) / _HEADINGS:
        R = geometry.to_matrices(geometry.exp(np.array([0.0, 0.0, heading])))
        turned = (points - middle) @ R.T
        picture, own_corner = _picture(turned, cell)
        for score, shift in _best_shifts(picture, target):
            found.append((score, R, np.append(corner - own_corner + shift * cell, 0.0)))
    found.sort(key=lambda candidate: -candidate[0])
    placements = []
    for _, R, t in found[:_CANDIDATES]:
        t[2] = _lift((points - middle) @ R.T + t, reference, cell)
        placements.append(Alignment(R, t - R @ middle))
    return placements


def _picture(
    points: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Brightness (rows along x, columns along y), and the coordinates of its corner."""
    corner = np.floor(points[:, :2].min(axis=0) / cell) * cell
    at = ((points[:, :2] - corner) / cell).astype(np.int64)
    layer = np.floor((points[:, 2] - points[:, 2].min()) / _LAYER).astype(np.int64)
    shape, n_layers = at.max(axis=0) + 1, int(layer.max()) + 1
    filled = np.unique((at[:, 0] * shape[1] + at[:, 1]) * n_layers + layer) // n_layers
    layers = np.bincount(filled, minlength=int(shape.prod())).reshape(shape)
    return np.log1p(layers), corner


def _best_shifts(
    picture: NDArray[np.float64], target: NDArray[np.float64]
) -> list[tuple[float, NDArray[np.float64]]]:
    """Shifts in cells that bring bright onto bright, with the correlation."""
    sizes = [_even(a + b) for a, b in zip(picture.shape, target.shape, strict=True)]
    # of each the mean is removed, so that two wide and empty floors do not win by their size
    ours, theirs = (image - image.mean() * (image > 0) for image in (picture, target))
    spectrum = np.conj(np.fft.rfft2(ours, sizes)) * np.fft.rfft2(theirs, sizes)
    scores = np.fft.irfft2(spectrum, sizes)
    shifts = []
    for _ in range(2):
        best = np.array(np.unravel_index(np.argmax(scores), scores.shape))
        score = float(scores[tuple(best)])
        signed = np.where(best >= np.array(target.shape), best - np.array(sizes), best)
        shifts.append((score, signed.astype(np.float64)))
        rows, columns = (
            (np.arange(-_APART, _APART + 1) + b) % n for b, n in zip(best, sizes, strict=True)
        )
        scores[np.ix_(rows, columns)] = -np.inf
    return shifts


def _even(n: int) -> int:
    """Return a length of at least n whose transform is fast."""
    return 1 << (n - 1).bit_length()


def _lift(points: NDArray[np.float64], reference: NDArray[np.float64], cell: float) -> float:
    """Height that brings the lowest points of common cells together."""
    ours, low = _floors(points, cell)
    theirs, true_low = _floors(reference, cell)
    _, i, j = np.intersect1d(ours, theirs, assume_unique=True, return_indices=True)
    return float(np.median(true_low[j] - low[i])) if len(i) else 0.0


def _floors(
    points: NDArray[np.float64], cell: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    keys = column_keys(points, cell)
    order = np.lexsort((points[:, 2], keys))
    unique, first = np.unique(keys[order], return_index=True)
    return unique, points[order][first, 2]
