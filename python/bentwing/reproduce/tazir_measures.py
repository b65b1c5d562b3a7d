# SPDX-License-Identifier: MIT OR Apache-2.0
"""Errors of a result in the measures of Tazir 2020."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.evaluate.poses import pose_errors

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.evaluate.poses import PoseErrors
    from bentwing.reproduce.campaign import Flown, Result

    Array = NDArray[np.float64]

FAR = 1.0
"""m, of RTE: the estimate has left the way."""


@dataclass(frozen=True, slots=True)
class Measured:
    """Errors of a result in the paper's measures.

    Attributes
    ----------
    errors : RTE (m) and RRE (rad) at the truth's stamps that the estimate covers
    way : (N,) m, flown until then
    lost_after : m, of the way, at which the RTE first exceeds `FAR`; None: never
    registration : (K, 2) s and m, times and RMSE of the registered scans
    """

    errors: PoseErrors
    way: Array
    lost_after: float | None
    registration: Array


def measure(flight: Flown, result: Result) -> Measured:
    """Measure a result that has a trajectory."""
    if result.trajectory is None:
        msg = f"{flight.flight.name}: expected an estimate, got none: {result.why}"
        raise ValueError(msg)
    errors = pose_errors(result.trajectory, flight.truth)
    way = np.interp(errors.times, flight.truth.times, flight.way)
    far = np.flatnonzero(errors.rte > FAR)
    registered = [w for w in result.windows if w.registration_rmse is not None]
    rmse = np.array([(w.time, w.registration_rmse) for w in registered]).reshape(-1, 2)
    return Measured(errors, way, float(way[far[0]]) if len(far) else None, rmse)
