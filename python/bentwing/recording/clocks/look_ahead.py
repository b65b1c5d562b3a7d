# SPDX-License-Identifier: MIT OR Apache-2.0
"""Show messages to the clocks of their streams some seconds before they are decoded."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from bentwing.base.clock import NS_PER_S

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from bentwing.recording.streams import Stream

AHEAD_NS = 7 * NS_PER_S
"""How long a message is held: the clock at its time is then known from both sides."""
MOST_BYTES = 200_000_000
"""Held at a time; the largest lidars fill it in two seconds."""


def look_ahead(
    messages: Iterable[tuple[str, int, bytes]], streams: Mapping[str, Stream]
) -> Iterator[tuple[str, int, bytes]]:
    """Yield messages as they come, later, those of a topic in the order of their stamps.

    Parameters
    ----------
    messages : (topic, recorder's time in ns, bytes) in time order
    streams : by topic
    """
    order: deque[tuple[str, int]] = deque()
    waiting: dict[str, deque[bytes]] = {topic: deque() for topic in streams}
    n_bytes = 0
    for topic, recorder_ns, raw in messages:
        back = streams[topic].foresee(recorder_ns, raw)
        if back is None:
            continue
        waiting[topic].insert(len(waiting[topic]) - back, raw)
        order.append((topic, recorder_ns))
        n_bytes += len(raw)
        while order and (order[0][1] < recorder_ns - AHEAD_NS or n_bytes > MOST_BYTES):
            first, first_ns = order.popleft()
            released = waiting[first].popleft()
            n_bytes -= len(released)
            yield first, first_ns, released
    for topic, recorder_ns in order:
        yield topic, recorder_ns, waiting[topic].popleft()
