# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stamps that a host gives when a message reaches it: jitter, lateness, steps, drift and losses."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.realism.effect import of_about
from bentwing.simulate.records import EncoderRecord, FixRecord, ImuRecord, Record

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SHAPE = 4.0
"""Of the Gamma distribution of delays: none is negative, some are long."""
APART = 3e-4
"""s, between messages that had to wait and are then read one after the other."""


@dataclass(slots=True)
class HostClock:
    """Stamps of the messages of one sensor.

    Attributes
    ----------
    jitter : s, standard deviation of the delays
    mean : s, mean of the delays; zero where the sensor's stamps are the recording's time
    late : share of the messages that come late
    latest : s, how late at most
    step : s, of which stamps are multiples
    drift : s/s, of the sensor's clock against the IMU's
    lost : share of the messages that never come
    """

    jitter: float
    mean: float
    late: float
    latest: float
    step: float
    drift: float
    lost: float
    rng: np.random.Generator = field(repr=False)
    shifts: list[float] = field(default_factory=list, init=False, repr=False)
    _last: float = field(default=-np.inf, init=False, repr=False)

    def stamped(self, records: Sequence[Record]) -> list[Record]:
        """Return what reaches the host of `records`, given in their order, with the host's stamps."""
        result: list[Record] = []
        for record, delay, keep in zip(records, *self._drawn(len(records)), strict=True):
            if keep:
                result.append(self._read(record, float(delay)))
        return result

    def _drawn(self, n: int) -> tuple[Array, NDArray[np.bool_]]:
        rng = self.rng
        delays = self.mean + self.jitter * (rng.gamma(SHAPE, 1.0, n) - SHAPE) / np.sqrt(SHAPE)
        is_late = rng.random(n) < self.late
        delays += is_late * rng.uniform(0.3, 1.0, n) * self.latest
        return delays, rng.random(n) >= self.lost

    def _read(self, record: Record, delay: float) -> Record:
        # A host that was busy reads in order what has come since then.
        read = max(record.stamp * (1.0 + self.drift) + delay, self._last + APART)
        self._last = read
        stamp = round(read / self.step) * self.step if self.step else read
        shift = stamp - record.stamp
        self.shifts.append(shift)
        return replace(record, stamp=stamp, arrival=record.arrival + max(0.0, shift))


@dataclass(slots=True)
class Host:
    """The computer that reads all sensors but the receiver, which has its own time.

    Attributes
    ----------
    lidar, imu, encoder : their clocks
    gaps : from when to when it records nothing, s
    """

    lidar: HostClock
    imu: HostClock
    encoder: HostClock
    gaps: tuple[tuple[float, float], ...]

    def recorded(self, records: Sequence[Record]) -> list[Record]:
        """Return what it records of `records`, given in the order of each sensor."""
        kept: list[Record] = [r for r in records if isinstance(r, FixRecord)]
        kept += self.imu.stamped([r for r in records if isinstance(r, ImuRecord)])
        kept += self.encoder.stamped([r for r in records if isinstance(r, EncoderRecord)])
        others = ImuRecord | EncoderRecord | FixRecord
        kept += self.lidar.stamped([r for r in records if not isinstance(r, others)])
        return [r for r in kept if not any(a <= r.arrival < b for a, b in self.gaps)]

    def latency(self) -> float:
        """Return by how much the lidar's stamps are later than the IMU's, s, in the middle of all."""
        if not self.lidar.shifts or not self.imu.shifts:
            return 0.0
        return float(np.median(self.lidar.shifts) - np.median(self.imu.shifts))


def draw_host(rng: np.random.Generator, level: float, duration: float) -> Host:
    """Draw the clocks of a recording of `duration` s.

    Steps and drift are the lidar's: the IMU's clock is the one that all others are compared with.
    """
    jitter = 4e-4 * level
    late = {"late": 0.01 * level, "latest": 0.008 * level}
    drifts = [of_about(rng, 3e-5 * level) for _ in range(2)]
    n_gaps = max(1, round(duration / 60.0))
    starts = rng.uniform(0.3, 0.7, n_gaps) * duration
    gaps = [(float(t), float(t + 0.02 * level * rng.uniform(1.0, 3.0))) for t in starts]
    delayed = 0.5 * np.sqrt(SHAPE) * jitter
    lidar = HostClock(
        jitter,
        delayed,
        step=2.5e-4 * level,
        drift=drifts[0],
        lost=0.0033 * level,
        rng=_spawned(rng),
        **late,
    )
    imu = HostClock(
        jitter, 0.0, step=0.0, drift=0.0, lost=0.0005 * level, rng=_spawned(rng), **late
    )
    encoder = HostClock(
        jitter, delayed, step=0.0, drift=drifts[1], lost=0.0005 * level, rng=_spawned(rng), **late
    )
    return Host(lidar, imu, encoder, tuple(gaps))


def _spawned(rng: np.random.Generator) -> np.random.Generator:
    return np.random.default_rng(rng.integers(2**63))
