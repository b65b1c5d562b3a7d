# SPDX-License-Identifier: MIT OR Apache-2.0
"""The ground of a site: which points lie on it, and its heights on a grid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import distance_transform_edt, grey_opening, map_coordinates
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import spsolve

from bentwing.base.value import Value
from bentwing.products.cell_sums import centres_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

BAND = 0.15
"""m above and below the terrain within which a point lies on it."""
_SLOPE = 0.4  # of the steepest terrain, rise by way
_STEP = 0.15  # m by which a cell may stand out of the smallest window
_HIGHEST = 2.5  # m by which it may stand out of any
_LARGEST = 20.0  # m, of what is no ground: the roof of a house
_FAR = 2.0  # m, half the width of the widest gap that is filled


@dataclass(frozen=True, slots=True, eq=False)
class Terrain(Value):
    """Heights of the ground.

    Attributes
    ----------
    heights : (H, W) m, of the cells' centres, lowest y first; NaN where the ground is unknown
    measured : (H, W) whether points of the ground lie in the cell; others are interpolated
    sigmas : (H, W) m, standard deviation of points across the ground; NaN where there is none
    counts : (H, W) points of the ground
    cell : m, edge of a cell
    origin : (2,) m, lower left corner
    """

    heights: Array
    measured: NDArray[np.bool_]
    sigmas: Array
    counts: NDArray[np.int64]
    cell: float
    origin: Array

    def sentence(self) -> str:
        """Say what there is."""
        area = self.cell**2 * np.array([self.measured.sum(), np.isfinite(self.heights).sum()])
        low, high = np.nanmin(self.heights), np.nanmax(self.heights)
        return (
            f"{area[0]:.1f} m² of ground measured, {area[1] - area[0]:.1f} m² interpolated, heights "
            f"from {low:.2f} to {high:.2f} m"
        )

    def centres(self) -> Array:
        """Return the cells' centres (H, W, 2) m."""
        return centres_of(self.origin, self.heights.shape, self.cell)

    def height_at(self, places: Array) -> Array:
        """Return the height (N,) m below places (N, 2) m; NaN where it is unknown."""
        return interpolated(self.heights, (places - self.origin) / self.cell - 0.5)


def interpolated(grid: Array, at: Array) -> Array:
    """Interpolate a grid (H, W) at places (N, 2) in cells from the first centre, right and up.

    Beside cells without a value (NaN), the others around the place count; far from any there is none.
    """
    known = np.isfinite(grid)
    middle = float(grid[known].mean()) if known.any() else 0.0
    column, row = at.T
    filled = np.where(known, grid - middle, 0.0)
    sums = map_coordinates(filled, (row, column), order=1, mode="nearest")
    shares = map_coordinates(known.astype(np.float64), (row, column), order=1, mode="nearest")
    height, width = grid.shape
    outside = (row < -0.5) | (row > height - 0.5) | (column < -0.5) | (column > width - 0.5)
    # In a cell with a value, its own share is a quarter or more.
    shares[outside | (shares < 0.25)] = np.nan
    found: Array = sums / shares + middle
    return found


def ground_cells(lowest: Array, cell: float) -> NDArray[np.bool_]:
    """Tell which cells of a grid are ground, by a progressive morphological filter.

    Windows grow; what stands out of the opening by more than the slope explains is an object.

    Parameters
    ----------
    lowest : (H, W) m, of the lowest surface in each cell; NaN where there is none
    cell : m, edge of a cell

    Returns
    -------
    (H, W) bool; False where there is no surface

    References
    ----------
    Zhang 2003, A progressive morphological filter for removing nonground measurements from airborne
    LIDAR data, eq. (2) to (7), with windows that grow exponentially.
    """
    seen = np.isfinite(lowest)
    if not seen.any():
        return seen
    rows, columns = distance_transform_edt(~seen, return_distances=False, return_indices=True)
    surface = lowest[rows, columns]
    ground, before, half = seen.copy(), 1, 1
    while (window := 2 * half + 1) * cell <= _LARGEST + 2 * cell:
        opened = grey_opening(surface, size=(window, window), mode="nearest")
        allowed = min(_STEP + _SLOPE * (window - before) * cell, _HIGHEST)
        ground &= surface - opened <= allowed
        surface, before, half = opened, window, 2 * half
    return ground


def carried_on(heights: Array, cell: float) -> Array:
    """Return heights (H, W) m whose gaps are filled as a membrane between their edges would.

    Gaps are what is at most 4 m wide between known heights; beyond the outer ones nothing is added.
    """
    known = np.isfinite(heights)
    gaps = _gaps(known, cell)
    filled = heights.copy()
    if not gaps.any():
        return filled
    numbers = np.full(heights.shape, -1, np.intp)
    numbers[gaps] = np.arange(np.count_nonzero(gaps))
    middle = float(heights[known].mean())
    rows, columns, values = [], [], []
    diagonal, right = np.full(np.count_nonzero(gaps), 1e-9), np.zeros(np.count_nonzero(gaps))
    for axis in (0, 1):
        first, second = (
            np.moveaxis(numbers, axis, 0)[part] for part in (slice(-1), slice(1, None))
        )
        low, high = (np.moveaxis(heights, axis, 0)[part] for part in (slice(-1), slice(1, None)))
        for mine, other, height in ((first, second, high), (second, first, low)):
            inner, edge = (mine >= 0) & (other >= 0), (mine >= 0) & np.isfinite(height)
            rows.append(mine[inner])
            columns.append(other[inner])
            values.append(np.full(np.count_nonzero(inner), -1.0))
            np.add.at(diagonal, mine[inner | edge], 1.0)
            np.add.at(right, mine[edge], height[edge] - middle)
    n = len(diagonal)
    rows.append(np.arange(n))
    columns.append(np.arange(n))
    values.append(diagonal)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    filled[gaps] = spsolve(csr_matrix(entries, shape=(n, n)), right) + middle
    return filled


def _gaps(known: NDArray[np.bool_], cell: float) -> NDArray[np.bool_]:
    """Tell which cells are between known ones: where no circle of 2 m without a known cell fits."""
    margin = int(_FAR / cell) + 2
    padded = np.pad(known, margin)
    if not known.any():
        return known
    wide = distance_transform_edt(~padded) * cell <= _FAR
    closed = distance_transform_edt(wide) * cell > _FAR
    found: NDArray[np.bool_] = closed[margin:-margin, margin:-margin] & ~known
    return found
