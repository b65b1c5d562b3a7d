# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find roughly by how much two clocks differ, from the speeds of what both watched."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.evaluate.track import bridges

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.track import Track

_CHORD = 0.5  # s over which a speed is measured, or two intervals of the reference
_STEPS = 5  # of the search, per chord
_MOST = 6  # offsets that are worth a closer look
_APART = 2  # chords between two of them
_LONGEST = 5_000_000  # steps of a search, for the memory of its transforms


def coarse_shifts(estimate: Trajectory, track: Track) -> list[float]:
    """Find shifts for which the speeds agree best, best first.

    A shift is added to the times of the track to get times of the estimate. The measure is how
    much of the sum of squares of the track's speeds about their mean is explained by the
    estimate's speeds; what does not overlap explains nothing. Speeds do not depend on the frame.

    Raises
    ------
    InputError
        If the tracked point hardly moves.
    """
    chord = max(_CHORD, 2 * track.interval())
    step = chord / _STEPS
    ours, own_weights = _speeds(estimate.times, estimate.positions, chord, step)
    theirs, weights = _speeds(track.times, track.positions, chord, step)
    if not weights.any() or not own_weights.any() or np.ptp(theirs[weights > 0]) < 1e-3:
        msg = (
            "the clock offset cannot be found, because the speeds of the reference do not vary; "
            "give it with --clock-offset"
        )
        raise InputError(msg)
    gain = _gain(ours, own_weights, theirs, weights)
    first = estimate.times[0] - track.times[0] - step * (len(theirs) - 1)
    return [first + step * i for i in _peaks(gain)]


def _speeds(
    times: NDArray[np.float64], positions: NDArray[np.float64], chord: float, step: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Speeds over chords that begin every step, and 1 where they are known."""
    n = int(max(times[-1] - times[0] - chord, 0) / step) + 1
    if n > _LONGEST:
        msg = f"a trajectory lasts {times[-1] - times[0]:.3g} s; are its stamps in seconds?"
        raise InputError(msg)
    begin = times[0] + step * np.arange(n)
    ends = [np.stack([np.interp(t, times, p) for p in positions.T]) for t in (begin, begin + chord)]
    known = ~(bridges(times, begin) | bridges(times, begin + chord))
    return np.linalg.norm(ends[1] - ends[0], axis=0) / chord * known, known.astype(np.float64)


def _gain(
    ours: NDArray[np.float64],
    own_weights: NDArray[np.float64],
    theirs: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Sum of `(theirs - mean)² - (theirs - ours)²` over the overlap, for every shift."""
    mean = theirs[weights > 0].mean()
    n = 1 << (len(ours) + len(theirs) - 1).bit_length()

    def transformed(values: NDArray[np.float64]) -> NDArray[np.complex128]:
        return np.fft.rfft(values, n)

    sums = (
        transformed(own_weights) * transformed((weights * (mean**2 - 2 * mean * theirs))[::-1])
        + 2 * transformed(ours) * transformed(theirs[::-1])
        - transformed(ours**2) * transformed(weights[::-1])
    )
    return np.fft.irfft(sums, n)[: len(ours) + len(theirs) - 1]


def _peaks(gain: NDArray[np.float64]) -> list[int]:
    left = gain.copy()
    peaks: list[int] = []
    for _ in range(_MOST):
        best = int(np.argmax(left))
        if not np.isfinite(left[best]):
            break
        peaks.append(best)
        left[max(best - _APART * _STEPS, 0) : best + _APART * _STEPS + 1] = -np.inf
    return peaks
