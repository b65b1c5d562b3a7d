# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sentences about what a stream dropped or lacked."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from bentwing.base.clock import Clock
    from bentwing.recording.clock_steps import ClockSteps
    from bentwing.recording.streams import Stream

MAX_LISTED = 3
REASONS = {
    "broken_messages": "{n} messages could not be read and were left out; the file is damaged there",
    "empty_scans": "{n} empty scans were left out",
    "broken_packets": "{n} packets are none of this sensor's and were left out",
    "bad_columns": "{n} columns lie outside of the turn or the time of their packet and were left out; "
    "check that the metadata are of the mode of the recording",
    "duplicate_stamps": "{n} messages repeat the stamp before them and were left out; check the "
    "driver's time stamps",
    "stamp_jumps": "{n} messages have stamps that jump and were left out",
    "bad_point_time": "{n} points have a time more than a second from their message and were left "
    "out",
    "late_points": "{n} points are earlier than the sweep before them and were left out",
}


def stream_warnings(topic: str, stream: Stream, clock: Clock) -> list[str]:
    """Return the sentences about one stream after a pass, or during it as far as it got."""
    sentences = [
        f"{topic}: {text.format(n=stream.counts[reason])}"
        for reason, text in REASONS.items()
        if stream.counts[reason]
    ]
    monitor = stream.monitor
    if monitor.first_backwards_ns is not None:
        sentences.append(
            f"{topic}: {stream.counts['backwards_stamps']} messages have stamps going backwards and "
            f"were left out, the first at {_seconds(clock, monitor.first_backwards_ns):.1f} s; check "
            "that only one driver publishes and that its clock is not set while recording"
        )
    sentences += _steps(topic, monitor.steps, clock)
    found = monitor.clock.findings
    if found.is_poor:
        sentences.append(
            f"{topic}: the stamps jitter by {1e3 * found.jitter:.1f} ms, and {found.late_share:.1%} come "
            f"up to {1e3 * found.latest:.0f} ms late; {found.n_corrected} of {found.n} were put where "
            "the sensor's period says; let the driver use the sensor's own time stamps"
        )
    gaps = [
        f"{(gap.end_ns - gap.start_ns) / 1e9:.1f} s from {_seconds(clock, gap.start_ns):.1f} s on"
        for gap in sorted(monitor.gaps, key=lambda gap: gap.start_ns - gap.end_ns)
    ]
    if gaps:
        more = f" and {len(gaps) - MAX_LISTED} shorter" if len(gaps) > MAX_LISTED else ""
        sentences.append(
            f"{topic}: {len(gaps)} gap(s): {', '.join(gaps[:MAX_LISTED])}{more}; check disk and "
            "network of the recording computer"
        )
    return sentences


def _steps(topic: str, steps: ClockSteps | None, clock: Clock) -> list[str]:
    """Return the sentence on a clock that was set."""
    if steps is None or not steps.found:
        return []
    shifts = [0, *(step.shift_ns for step in steps.found)]
    by = ", ".join(
        f"by {(before - after) / 1e9:+.1f} s at {_seconds(clock, step.stamp_ns):.1f} s"
        for (before, after), step in zip(itertools.pairwise(shifts), steps.found, strict=True)
    )
    return [
        f"{topic}: the clock was set while recording, {by}; what follows is put where the recorder's times "
        "say, to the milliseconds of their delays; where the carrier was moved meanwhile, map each session by "
        "itself with --start and --duration"
    ]


def _seconds(clock: Clock, stamp_ns: int) -> float:
    return float(clock.to_seconds(np.array([stamp_ns], dtype=np.int64))[0])
