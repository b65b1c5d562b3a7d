# SPDX-License-Identifier: MIT OR Apache-2.0
"""Poses that no window needs any more; what is learned of the calibration still moves them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing import _core

# Responses vary no faster than the corrections of a window: one of so many is kept.
KEPT_RESPONSE = 10


class FinalPoses:
    """A stretch of the trajectory, with how it follows the calibration.

    Parameters
    ----------
    samples : the stretch and at least the first sample behind it
    n : number of its samples
    slow : the slow states they belong to
    """

    def __init__(self, samples: _core.Samples, n: int, slow: _core.Globals) -> None:
        self._positions = samples.positions[:n]
        self._quats = samples.quats_xyzw[:n]
        self._slow = slow
        self._kept = np.minimum(np.arange(0, n + KEPT_RESPONSE, KEPT_RESPONSE), len(samples) - 1)
        self._responses = samples.responses_at(self._kept.tolist()).astype(np.float32)

    def by(self, slow: _core.Globals) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return positions (N, 3), m, and rotations (N, 4) by newer slow states."""
        kept = self._responses @ np.asarray(slow.moved_from(self._slow))
        at = np.arange(len(self._positions))
        moved = np.stack([np.interp(at, self._kept, part) for part in kept.T], axis=1)
        turned = geometry.multiply(geometry.exp(moved[:, :3]), self._quats)
        return self._positions + moved[:, 3:], turned
