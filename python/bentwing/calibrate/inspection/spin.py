# SPDX-License-Identifier: MIT OR Apache-2.0
"""How fast the head turns over time, and where it stalls, from the gyro or the encoder."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.odometry.stall import BIN, MIN_STALL, STALLED, TURNING

if TYPE_CHECKING:
    from numpy.typing import NDArray

SPINNING = 0.5  # rad/s, median; slower is the carrier's own motion


@dataclass(frozen=True, slots=True)
class Spin:
    """Rate of turn.

    Attributes
    ----------
    source : "gyro" or "encoder"
    times, rates : s and rad/s, one per quarter of a second
    usual : rad/s, median while turning; 0 where the head does not spin
    stalls : (start, length) in s, while the rate was below a quarter of the usual one
    """

    source: str
    times: list[float]
    rates: list[float]
    usual: float
    stalls: list[tuple[float, float]]


def spin_from_gyro(times: NDArray[np.float64], gyro: NDArray[np.float64]) -> Spin:
    """Return the rate of turn for gyro (M, 3) rad/s at times (M,) s."""
    return _spin("gyro", times, np.linalg.norm(gyro, axis=1))


def spin_from_encoder(times: NDArray[np.float64], angles: NDArray[np.float64]) -> Spin:
    """Return the rate of turn for unwrapped angles (K,) rad at times (K,) s."""
    rates = np.abs(np.diff(angles)) / np.maximum(np.diff(times), 1e-9)
    return _spin("encoder", times[1:], rates)


def _spin(source: str, times: NDArray[np.float64], rates: NDArray[np.float64]) -> Spin:
    if not len(times):
        return Spin(source, [], [], 0.0, [])
    bins = np.floor((times - times[0]) / BIN).astype(np.int64)
    numbers, first = np.unique(bins, return_index=True)
    medians = np.array([np.median(part) for part in np.split(rates, first[1:])])
    middles = times[0] + (numbers + 0.5) * BIN
    moving = medians[medians > SPINNING]
    usual = float(np.median(moving)) if len(moving) > 0.3 * len(medians) else 0.0
    stalls = _stalls(middles, medians, usual) if usual else []
    return Spin(source, middles.tolist(), medians.tolist(), usual, stalls)


def _stalls(
    middles: NDArray[np.float64], medians: NDArray[np.float64], usual: float
) -> list[tuple[float, float]]:
    """Return the slow stretches between the first and the last turn: before and after is rest."""
    turning = np.flatnonzero(medians > TURNING * usual)
    slow = medians < STALLED * usual
    slow[: turning[0]] = slow[turning[-1] :] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], slow.astype(np.int8), [0]])))
    stalls = [
        (float(middles[a] - BIN / 2), float(middles[b - 1] - middles[a] + BIN))
        for a, b in edges.reshape(-1, 2)
    ]
    return [stall for stall in stalls if stall[1] >= MIN_STALL]
