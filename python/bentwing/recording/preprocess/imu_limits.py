# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finds inertial samples at the end of an instrument's range: of them only is known that the truth lies beyond."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.recording.batches import ImuBatch

    Array = NDArray[np.float64]
    Mask = NDArray[np.bool_]

LEAST_LIMIT = np.repeat([0.1, 12.0], 3)
"""rad/s and m/s²: below this no IMU ends, and what repeats there is its resolution."""
# A stretch at the end is no limit while it may be chance with this probability, in steps of the resolution.
_CHANCE = 1e-6
_LEAST_RUN = 3
# s; what lasts longer the estimators do not bridge.
_LONGEST = 0.25


_INSTRUMENTS = {
    "gyro": ("gyro", "turn more slowly"),
    "accel": ("accelerometer", "damp the head"),
}


def limit_sentences(counts: Mapping[str, int]) -> list[str]:
    """Return what was bridged, by instrument, and what to do.

    Parameters
    ----------
    counts : of a recording and its preprocessing
    """
    return [
        f"{n:,} of {counts.get('imu.samples', n):,} samples of the {name} are at the end of its range; the "
        f"continuous estimator bridges them, but set a larger range in the IMU, or {advice}"
        for key, (name, advice) in _INSTRUMENTS.items()
        if (n := counts.get(f"preprocess.{key}_at_limit", 0))
    ]


class ImuLimits:
    """Marks the samples of an IMU, batch by batch, from the first stretch at the limit of an axis on.

    An axis is at its limit where it stays at the greatest value, or the least, that it has had so far
    for longer than a sensor of its resolution would by chance, while other axes go on.

    Parameters
    ----------
    counts : receives `preprocess.gyro_at_limit` and `preprocess.accel_at_limit`, samples
    """

    def __init__(self, counts: Counter[str]) -> None:
        self._counts = counts
        self._first, self._n_samples = np.inf, 0
        self._before = np.full((1, 6), np.nan)
        # Samples beside both ends, and how many of them repeat the one before, of each axis.
        self._n, self._n_repeated = np.zeros(6), np.zeros(6)
        self._ends = [_End(), _End()]

    def marked(self, batch: ImuBatch) -> ImuBatch:
        """Return the next samples with what is at a limit; those without stay as they are."""
        values = np.hstack([batch.gyro, batch.accel])
        self._first = min(self._first, float(batch.times[0]))
        self._n_samples += len(batch.times)
        repeats = values == np.vstack([self._before, values[:-1]])
        self._before = values[-1:]
        # Of samples that repeat altogether nothing is new.
        is_new = ~repeats.all(axis=1)
        at_ends = [
            end.reached(signed, is_new)
            for end, signed in zip(self._ends, (values, -values), strict=True)
        ]
        beside = ~(at_ends[0] | at_ends[1]) & is_new[:, None]
        self._n += beside.sum(axis=0)
        self._n_repeated += (beside & repeats).sum(axis=0)
        if not any(at_end.any() for at_end in at_ends):
            return batch
        longest = np.log(_CHANCE) / np.log((1.0 + self._n_repeated) / (2.0 + self._n))
        period = (float(batch.times[-1]) - self._first) / max(self._n_samples - 1, 1)
        at_limit = np.zeros_like(beside)
        for end, at_end in zip(self._ends, at_ends, strict=True):
            at_limit |= at_end & end.limits(np.maximum(_LEAST_RUN, 1.0 + longest), period)
        return self._counted(batch, at_limit)

    def _counted(self, batch: ImuBatch, at_limit: Mask) -> ImuBatch:
        if not at_limit.any():
            return batch
        for name, axes in zip(_INSTRUMENTS, (slice(3), slice(3, 6)), strict=True):
            if n := int(at_limit[:, axes].any(axis=1).sum()):
                self._counts[f"preprocess.{name}_at_limit"] += n
        return replace(batch, at_limit=at_limit)


class _End:
    """The greatest values of the six axes so far, and how long each axis stayed there."""

    def __init__(self) -> None:
        self._greatest = np.full(6, -np.inf)
        self._run, self._longest = np.zeros(6), np.zeros(6)

    def reached(self, values: Array, is_new: Mask) -> Mask:
        """Return where values (M, 6) are at the greatest so far, if that may be a limit."""
        greatest = values.max(axis=0)
        is_greater = greatest > self._greatest
        self._greatest = np.maximum(greatest, self._greatest)
        self._run[is_greater] = self._longest[is_greater] = 0.0
        can_end = self._greatest > LEAST_LIMIT
        at_end = (values == self._greatest) & can_end & is_new[:, None]
        if at_end.any():
            for row in at_end:
                self._run = (self._run + 1.0) * row
                self._longest = np.maximum(self._longest, self._run)
        else:
            self._run[:] = 0.0
        return np.asarray(at_end)

    def limits(self, runs: Array, period: float) -> Mask:
        """Return which axes (6,) have stayed there for so many samples, but not too long to be bridged."""
        is_long = self._longest >= runs
        return np.asarray(is_long & (self._longest * period < _LONGEST))
