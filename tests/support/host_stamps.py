# SPDX-License-Identifier: MIT OR Apache-2.0
"""Stamps of a periodic sensor with known true times, as a computer gives them."""

from __future__ import annotations

import numpy as np

from bentwing.recording.clocks.look_ahead import AHEAD_NS
from bentwing.recording.clocks.steady import SteadyClock

NS = 1_000_000_000
START_NS = 1_700_000_000 * NS
AHEAD = AHEAD_NS / NS


def host_stamps(
    rng,
    period,
    duration,
    *,
    jitter=0.0,
    late=0.0,
    latest=0.0,
    step=0.0,
    drift=0.0,
    lost=0.0,
    gap=None,
):
    """Return true times (N,) s, of the sensor's clock, and stamps (N,) ns.

    Delays are Gamma distributed with a deviation of `jitter`; `late` is the share that comes up to
    `latest` s later and holds up what follows; stamps are multiples of `step`; between the times of
    `gap` nothing is recorded.
    """
    times = np.arange(0.0, duration, period)
    n = len(times)
    delays = 0.5 * jitter * rng.gamma(4.0, 1.0, n)
    delays += (rng.random(n) < late) * rng.uniform(0.3, 1.0, n) * latest
    sensor = times * (1.0 + drift)
    read = np.empty(n)
    last = -np.inf
    for i, arrived in enumerate(sensor + delays):
        last = max(arrived, last + min(3e-4, 0.1 * period))
        read[i] = last
    if step:
        read = np.round(read / step) * step
    keep = rng.random(n) >= lost
    if gap is not None:
        keep &= (read < gap[0]) | (read > gap[1])
    return sensor[keep], START_NS + np.rint(read[keep] * NS).astype(np.int64)


def steadied(stamps_ns, *, ahead=AHEAD, spans=None):
    """Return what a clock makes of stamps (N,) ns, foreseen by `ahead` s, and the clock."""
    clock, found, shown = SteadyClock(), [], 0
    for stamp_ns in stamps_ns.tolist():
        while shown < len(stamps_ns) and stamps_ns[shown] <= stamp_ns + ahead * NS:
            clock.foresee(int(stamps_ns[shown]), None if spans is None else float(spans[shown]))
            shown += 1
        found.append(clock.steadied(stamp_ns))
    return np.array(found, dtype=np.int64), clock


def errors(times, stamps_ns):
    """Return how far stamps (N,) ns are from times (N,) s, a constant delay apart, s."""
    off = (stamps_ns - START_NS) / NS - times
    return off - np.median(off)
