# SPDX-License-Identifier: MIT OR Apache-2.0
"""How fast the clock of a sensor runs beside that of the recorder."""

from __future__ import annotations

from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.recording.messages import wire
from bentwing.recording.topics import PACKET_TYPES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.peek import Peek

LOOKED_AT, LEAST, PART = 60.0, 10.0, 1.0
"""s, of the beginning, the least of it that shows a rate, and of the parts of which it is put together."""
NOTABLE = 3e-3
"""Of the rate. Crystals differ by 1e-4 at most; whoever counts turns of a slow motor is off by more."""
CERTAIN = 4.0
"""Times what the waiting leaves unclear."""


class ClockRate(NamedTuple):
    """Seconds that a topic's clock gains in a second of the recorder's, and how unclear they are."""

    topic: str
    gain: float
    unclear: float


def rate_of(source: Source, peeked: Peek) -> ClockRate | None:
    """Return how fast the clock of a topic runs; None where it has none, or too little is there."""
    if peeked.use_recorder_time or peeked.topic.type in PACKET_TYPES:
        return None
    return clock_rate(peeked.topic.name, _stamps(source, peeked.topic.name))


def clock_rate(topic: str, stamps_ns: Iterable[tuple[int, int]]) -> ClockRate | None:
    """Return the rate of a clock by the beginning of its stream; None where that is too short.

    Messages wait before they are recorded, some of them long: of each second the one that waited least
    counts.

    Parameters
    ----------
    stamps_ns : by message the sensor's stamp and the recorder's, in the order of the recorder's
    """
    first: tuple[int, int] | None = None
    best: dict[int, tuple[float, float]] = {}  # by part: gained and passed, s
    for sensor_ns, recorder_ns in stamps_ns:
        first = first or (sensor_ns, recorder_ns)
        passed = (recorder_ns - first[1]) / 1e9
        if passed > LOOKED_AT:
            break
        gained = (sensor_ns - first[0]) / 1e9 - passed
        part = int(passed / PART)
        best[part] = max(best.get(part, (-np.inf, 0.0)), (gained, passed))
    if len(best) <= LEAST / PART:
        return None
    best.popitem()  # of the last part there may be late messages only
    gained_by_part, times = np.array(list(best.values())).T
    return ClockRate(topic, *_slope(times, gained_by_part))


def run_apart(first: ClockRate, second: ClockRate) -> bool:
    """Whether two clocks certainly run apart by more than crystals do."""
    unclear = float(np.hypot(first.unclear, second.unclear))
    return abs(first.gain - second.gain) > max(NOTABLE, CERTAIN * unclear)


def _stamps(source: Source, topic: str) -> Iterator[tuple[int, int]]:
    for _, recorder_ns, raw in source.messages({topic}):
        with suppress(wire.BrokenMessageError):
            yield wire.stamp_ns(raw, cdr=source.cdr), recorder_ns


def _slope(times: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the slope of values (N,) over times (N,), and that of what is beside the line at most."""
    since = times - times.mean()
    slope = float(since @ values / (since @ since))
    beside = values - values.mean() - slope * since
    return slope, float(np.ptp(beside) / np.ptp(times))
