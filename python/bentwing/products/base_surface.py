# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a volume is measured against: a plane or the ground around an area."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.ndimage import distance_transform_edt

from bentwing.base.errors import InputError
from bentwing.base.value import Value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.products.area import Area
    from bentwing.products.ground import Terrain

    Array = NDArray[np.float64]

_AROUND = 1.0  # m beside the area within which the base is measured
_FEWEST = 10  # cells of it
_CORNERS = 10.0  # of the edge that a triangulation of a gap hangs on, at least
_ROUNDS = 10
_SIGMAS = 3.0  # beyond which a cell is no part of the plane


@dataclass(frozen=True, slots=True, eq=False)
class Base(Value):
    """A base.

    Attributes
    ----------
    heights : (H, W) m; NaN where it is unknown
    covariance : (3, 3) of a plane's height at `centre`, m², and slopes; None where it is no plane
    centre : (2,) m
    offset : m, standard uncertainty of all heights together
    """

    heights: Array
    covariance: Array | None = None
    centre: Array | None = None
    offset: float = 0.0

    def sigma(self, centres: Array, weights: Array) -> float:
        """Return the uncertainty, m³, that the base gives to a volume.

        Parameters
        ----------
        centres : (H, W, 2) m, of the cells
        weights : (H, W) m², their areas
        """
        area = float(weights.sum())
        if self.covariance is None or self.centre is None or not area:
            return self.offset * area
        moment = np.einsum("hw,hwi->i", weights, centres - self.centre)
        row = np.array([area, *moment])
        return float(np.sqrt(row @ self.covariance @ row + (self.offset * area) ** 2))


def plane_around(top: Terrain, area: Area) -> Base:
    """Fit a plane to the surface within a metre around an area, robustly.

    Raises
    ------
    InputError
        If too little of it was measured.
    """
    ring = _ring(top, area) & top.measured
    places, heights = top.centres()[ring], top.heights[ring]
    _require(len(heights))
    centre = places.mean(axis=0)
    columns = np.column_stack([np.ones(len(places)), places - centre])
    kept = np.ones(len(heights), np.bool_)
    for _ in range(_ROUNDS):
        found, *_ = np.linalg.lstsq(columns[kept], heights[kept], rcond=None)
        left = heights - columns @ found
        sigma = 1.4826 * float(np.median(np.abs(left[kept])))
        now = np.abs(left) <= max(_SIGMAS * sigma, 1e-4)
        if now.sum() < _FEWEST or np.array_equal(now, kept):
            break
        kept = now
    residual = float(np.sqrt((left[kept] ** 2).sum() / max(kept.sum() - 3, 1)))
    covariance = residual**2 * np.linalg.pinv(columns[kept].T @ columns[kept])
    grid = top.centres() - centre
    return Base(found[0] + grid @ found[1:], covariance, centre)


def ground_around(terrain: Terrain, top: Terrain, area: Area) -> Base:
    """Carry the ground around an area on below it, linearly between its edges.

    Parameters
    ----------
    terrain : the ground
    top : gives the cells of the result

    Raises
    ------
    InputError
        If too little of it was measured.
    """
    ring = _ring(terrain, area) & terrain.measured
    _require(int(ring.sum()))
    places, heights = terrain.centres()[ring], terrain.heights[ring]
    # Cells on a grid lie on circles in fours, over which a triangulation takes long.
    places = places + np.random.default_rng(0).uniform(-1e-3, 1e-3, places.shape) * terrain.cell
    centre, middle = places.mean(axis=0), heights.mean()
    linear = LinearNDInterpolator(places - centre, heights - middle)
    found = linear(top.centres().reshape(-1, 2) - centre).reshape(top.heights.shape) + middle
    # Each cell of the edge carries about as much as the others, and its own noise.
    noise = terrain.sigmas[ring] / np.sqrt(np.maximum(terrain.counts[ring], 1))
    return Base(found, offset=float(np.sqrt((noise**2).mean() / _CORNERS)))


def _ring(surface: Terrain, area: Area) -> NDArray[np.bool_]:
    """Tell which cells (H, W) lie beside an area, and not in it."""
    shape = surface.heights.shape
    inside = area.shares(surface.origin, shape, surface.cell) > 0
    if not inside.any():
        return inside
    distance = distance_transform_edt(~inside) * surface.cell
    around: NDArray[np.bool_] = ~inside & (distance <= _AROUND)
    return around


def _require(n: int) -> None:
    if n < _FEWEST:
        msg = (
            f"only {n} cells within {_AROUND:g} m around the area were measured, {_FEWEST} are needed for a base; "
            "are its coordinates those of the map? give another area, or another run as base"
        )
        raise InputError(msg)
