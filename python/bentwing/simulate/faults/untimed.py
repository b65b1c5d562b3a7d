# SPDX-License-Identifier: MIT OR Apache-2.0
"""Lidars whose drivers do not say when each point was measured, as those of many data sets do not."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.faults.fault import Changes, Fault, Subject
from bentwing.simulate.faults.messages import (
    NS_PER_S,
    is_scan,
    set_stamp,
    set_table,
    stamp_ns,
    table,
    time_field,
)

if TYPE_CHECKING:
    from bentwing.simulate.faults.fault import Message

CAUSE = r"time per (point|beam)|time_(increment|field|reference)"


def _untimed(message: Message) -> Message:
    """Take the times out of a message."""
    if is_scan(message):
        message.time_increment = message.scan_time = 0.0
        return message
    rows = table(message)
    names = [name for name in rows.dtype.names or () if name != time_field(rows)]
    packed = np.empty(len(rows), [(name, rows.dtype[name].str) for name in names])
    for name in names:
        packed[name] = rows[name]
    fields = {field.name: field for field in message.fields}
    message.fields = [fields[name] for name in names]
    sizes = [packed.dtype[name].itemsize for name in names]
    for field, offset in zip(message.fields, np.cumsum([0, *sizes[:-1]]).tolist(), strict=True):
        field.offset = offset
    message.point_step = packed.dtype.itemsize
    message.row_step = message.point_step * message.width
    set_table(message, packed)
    return message


def _length(message: Message) -> float:
    """Return the time from the first to the last point of a message, s."""
    if is_scan(message):
        return float(message.time_increment) * (len(message.ranges) - 1)
    rows = table(message)
    return float(rows[time_field(rows)].max()) if len(rows) else 0.0


def _stamped_at_end(message: Message) -> Message:
    end_ns = stamp_ns(message) + round(_length(message) * NS_PER_S)
    set_stamp(message, end_ns)
    return _untimed(message)


def _without_times(_: Subject) -> Changes:
    return Changes(lidar=_untimed)


def _without_times_to_the_end(_: Subject) -> Changes:
    return Changes(lidar=_stamped_at_end)


FAULTS = (
    Fault(
        "times-none",
        "The lidar does not say when each point was measured; its stamps are those of first points.",
        _without_times,
        "none",
        CAUSE,
    ),
    Fault(
        "times-none-end",
        "The lidar does not say when each point was measured; its stamps are those of last points.",
        _without_times_to_the_end,
        "none",
        CAUSE,
    ),
)
