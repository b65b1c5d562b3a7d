# SPDX-License-Identifier: MIT OR Apache-2.0
"""All sensors of a rig, second by second."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.gnss import RATE_HZ as FIX_RATE_HZ
from bentwing.simulate.imu import RATE_HZ, Imu
from bentwing.simulate.records import EncoderRecord, ImuRecord, Record

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.simulate.events import Losses
    from bentwing.simulate.gnss import Receiver
    from bentwing.simulate.lidars.interface import LidarClock
    from bentwing.simulate.ranging import Ranger
    from bentwing.simulate.realism.samples import Samples
    from bentwing.simulate.realism.stamps import Host
    from bentwing.simulate.rig import Encoder, Rig

    Array = NDArray[np.float64]

CHUNK = 1.0
"""s, how much is in memory at a time."""
ENCODER_RATE_HZ = 200.0


@dataclass(frozen=True, slots=True)
class Sensors:
    """The sensors on a rig; their states advance with the stream.

    Attributes
    ----------
    host : gives the stamps, if the sensors do not
    samples : collects returns where they truly were
    """

    rig: Rig
    ranger: Ranger
    imu: Imu
    clock: LidarClock
    losses: Losses
    rng: np.random.Generator
    receiver: Receiver | None = None
    host: Host | None = None
    samples: Samples | None = None

    def stream(self, first: float, last: float) -> Iterator[tuple[float, float, list[Record]]]:
        """Measure from `first` to `last`, about a second at a time.

        Yields start, end and the records that arrived until then, in order of arrival.
        """
        pending: list[Record] = []
        for start in np.arange(first, last, CHUNK).tolist():
            end = min(start + CHUNK, last)
            pending += self._measure(start, end)
            pending.sort(key=lambda record: record.arrival)
            # What is measured later also arrives later than `end`.
            is_last = end >= last
            n_ready = len(pending) if is_last else sum(r.arrival <= end for r in pending)
            yield start, end, self.losses.remaining(pending[:n_ready])
            pending = pending[n_ready:]

    def _measure(self, start: float, end: float) -> list[Record]:
        records = self._inertial(start, end) + self._lidar(start, end)
        encoder = self.rig.head.encoder
        records += self._encoder(encoder, start, end) if encoder else []
        if self.receiver is not None:
            records += self.receiver.fixes(ticks(start, end, FIX_RATE_HZ))
        return records if self.host is None else self.host.recorded(records)

    def latency(self) -> float:
        """Return by how much the lidar's stamps are later than the IMU's, s."""
        return self.clock.latency + (0.0 if self.host is None else self.host.latency())

    def _inertial(self, start: float, end: float) -> list[Record]:
        times = ticks(start, end, RATE_HZ)
        gyro, accel = self.imu.sample(times, self.rig.imu(times))
        arrivals = times + 0.001 + self.rng.exponential(0.0005, len(times))
        rows = zip(times, arrivals, gyro, accel, strict=True)
        return [ImuRecord(*row) for row in rows]

    def _lidar(self, start: float, end: float) -> list[Record]:
        lidar = self.rig.head.lidar
        beams = lidar.beams(start, end)
        if beams is None:
            return []
        ranges, cosines = self.ranger.measure(beams)
        if self.samples is not None:
            self.samples.add(beams, ranges)
        return lidar.records(beams, ranges, cosines, self.clock, self.rng)

    def _encoder(self, encoder: Encoder, start: float, end: float) -> list[Record]:
        times = ticks(start, end, ENCODER_RATE_HZ) + 0.0012
        angles = np.mod(
            encoder.read(times) + self.rng.normal(0.0, encoder.sigma, len(times)), 2 * np.pi
        )
        arrivals = times + 0.001 + self.rng.exponential(0.0005, len(times))
        return [EncoderRecord(*row) for row in zip(times, arrivals, angles, strict=True)]


def ticks(start: float, end: float, rate_hz: float) -> Array:
    """Instants k / `rate_hz` in [start, end)."""
    first, last = (int(np.ceil(t * rate_hz - 1e-9)) for t in (start, end))
    return np.arange(first, last) / rate_hz
