# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every simulated lidar can do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.records import Record

    Array = NDArray[np.float64]

TRANSPORT = 0.004
"""s, mean time from the end of a measurement to its recording."""


@dataclass(frozen=True, slots=True)
class LidarClock:
    """The lidar's clock: a stamp τ belongs to the IMU's time τ − `latency`.

    Attributes
    ----------
    latency : s
    jitter : s, standard deviation of a message's stamp
    """

    latency: float
    jitter: float

    def stamps(self, times: Array, rng: np.random.Generator) -> Array:
        """Stamps of messages that begin at `times` (IMU clock)."""
        noise = rng.normal(0.0, 1.0, len(times)).clip(-3.0, 3.0)
        return times + self.latency + self.jitter * noise


class Lidar(Protocol):
    """A scanner: its pattern of beams, and how it reports ranges."""

    @property
    def topic(self) -> str:
        """Where it publishes."""
        ...

    @property
    def noise(self) -> float:
        """Standard deviation of its ranges, m."""
        ...

    @property
    def max_range(self) -> float:
        """Range up to which it sees anything, m."""
        ...

    @property
    def rings(self) -> Sequence[int]:
        """Number of each beam of a multi-beam lidar, from below, in the columns of its `Beams`."""
        ...

    @property
    def beam_sigma(self) -> float:
        """Usual error of a beam's stated direction, rad."""
        ...

    def beams(self, start: float, end: float) -> Beams | None:
        """Beams of all sweeps that begin in [start, end), s; None if there are none."""
        ...

    def records(
        self,
        beams: Beams,
        ranges: Array,
        cosines: Array,
        clock: LidarClock,
        rng: np.random.Generator,
    ) -> list[Record]:
        """Return the sweeps as they are recorded."""
        ...


def described_lidar(lidar: Lidar, kind: str, *, min_range: float) -> dict[str, Any]:
    """Return the section `lidar` of payload.yaml."""
    return {
        "topic": lidar.topic,
        "kind": kind,
        "min_range": min_range,
        "max_range": lidar.max_range,
        "range_sigma": lidar.noise,
    }
