# SPDX-License-Identifier: MIT OR Apache-2.0
"""Quality of a map against the true surface."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.evaluate.robust import MAD_TO_STD

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class SurfaceError:
    """Distances of map points from the true surface.

    Attributes
    ----------
    std : m, from the median absolute deviation
    bias : m, median signed distance
    rms : m, of the points that are not excluded
    n_points, n_excluded : excluded are those beyond the limit: mixed pixels, moving things
    best_ratio : std over that of the best possible map, None without one
    """

    std: float
    bias: float
    rms: float
    n_points: int
    n_excluded: int
    best_ratio: float | None = None


def surface_error(
    distances: NDArray[np.float64],
    *,
    limit: float = 0.2,
    best: NDArray[np.float64] | None = None,
) -> SurfaceError:
    """Summarize the distances of a map from the true surface.

    Parameters
    ----------
    distances : (N,) m, signed
    limit : m, points farther away are on no surface and are counted, not measured
    best : (M,) m, the same for the map made with the true trajectory and calibration

    Raises
    ------
    ValueError
        If no point is within the limit.
    """
    kept = distances[np.abs(distances) <= limit]
    if not len(kept):
        msg = f"distances: none of {len(distances)} is within the limit of {limit} m"
        raise ValueError(msg)
    bias = float(np.median(kept))
    std = MAD_TO_STD * float(np.median(np.abs(kept - bias)))
    ratio = None if best is None else std / surface_error(best, limit=limit).std
    rms = float(np.sqrt(np.mean(kept**2)))
    return SurfaceError(std, bias, rms, len(distances), len(distances) - len(kept), ratio)
