# SPDX-License-Identifier: MIT OR Apache-2.0
"""How large the noise of an IMU shows itself in the windows of an estimate."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.recording import Payload


def with_believed_noise(payload: Payload, estimate: Estimate) -> Payload:
    """Return a payload with the noise that the IMU has in most windows of an estimate."""
    found = [w.imu_noise for w in estimate.windows if w.imu_noise is not None]
    if payload.imu is None or not found:
        return payload
    gyro, accel = sorted(g for g, _ in found), sorted(a for _, a in found)
    middle = len(found) // 2
    noise = {"gyro_noise": gyro[middle], "accel_noise": accel[middle]}
    return payload.model_copy(update={"imu": payload.imu.model_copy(update=noise)})


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
