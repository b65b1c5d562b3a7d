# SPDX-License-Identifier: MIT OR Apache-2.0
"""How large the noise of an IMU shows itself in the windows of an estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate


def shown_noise(estimate: Estimate) -> tuple[list[float], list[tuple[float, float]]]:
    """Return times, s, and the noise of gyro and accelerometer then, over what is stated.

    What an accelerometer feels is mostly the vibration of rotors, which comes and goes. The noise of a gyro
    is its own: where the residuals are small the fit has followed it, so it is no less than stated. A
    window that cannot tell takes the nearest that can.
    """
    times = np.array([w.time for w in estimate.windows])
    gyro = _ratios(times, [w.gyro_rms for w in estimate.windows])
    accel = _ratios(times, [w.accel_rms for w in estimate.windows])
    ratios = zip(np.maximum(1.0, gyro).tolist(), accel.tolist(), strict=True)
    return times.tolist(), list(ratios)


def _ratios(times: NDArray[np.float64], rms: list[float | None]) -> NDArray[np.float64]:
    """Return one ratio per window; one where none can tell."""
    known = np.array([r is not None for r in rms], dtype=bool)
    if not known.any():
        return np.ones(len(times))
    found = np.interp(times, times[known], np.array([r for r in rms if r is not None]))
    return np.asarray(found, dtype=np.float64)
