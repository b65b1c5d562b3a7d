# SPDX-License-Identifier: MIT OR Apache-2.0
"""The history of the biases that an estimate found, taken out of the inertial samples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.base.window_record import WindowRecord

# A window that knows a bias this much less well than the last one says nothing of its history: what
# changes until then is what is known, not the bias.
SETTLED = 2.0


def has_inertial_states(estimate: Estimate) -> bool:
    """Whether an estimate used an IMU, so that its biases mean something."""
    return "gyro_bias" in estimate.calibration.std


def drift_of(estimate: Estimate, name: str, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how far a bias was at `times` (M,) from its value in the calibration (M, 3).

    Parameters
    ----------
    name : `gyro_bias` or `accel_bias`
    """
    final = np.asarray(getattr(estimate.calibration, name))
    settled = _settled(estimate.windows, name)
    if not settled:
        return np.zeros((len(times), 3))
    at = np.array([w.time for w in settled])
    values = np.array([getattr(w, name) for w in settled]) - final
    return np.stack([np.interp(times, at, axis) for axis in values.T], axis=1)


def _settled(windows: Sequence[WindowRecord], name: str) -> list[WindowRecord]:
    known = [(w, max(w.std[name])) for w in windows if w.std is not None and name in w.std]
    return [w for w, std in known if std <= SETTLED * known[-1][1]]
