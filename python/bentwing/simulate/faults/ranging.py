# SPDX-License-Identifier: MIT OR Apache-2.0
"""Lidars that look elsewhere, measure something else or say so, or that stay level."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.faults import messages
from bentwing.simulate.faults.fault import SOLID, Changes, Fault, Subject
from bentwing.simulate.faults.level import level_scan
from bentwing.simulate.faults.messages import change_ranges, is_scan, positions, set_positions

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.faults.fault import Message

    Array = NDArray[np.float64]

CONSTANT = 5.0
NEAREST, FARTHEST = 0.5, 20.0
"""m, between which random ranges are drawn."""
MILLIMETRES = 1000.0


def _mirrored(_: Subject) -> Changes:
    """Negate the angles; the beams keep their order, and so their times."""

    def edit(message: Message) -> Message:
        if not is_scan(message):
            set_positions(message, positions(message) * [1.0, -1.0, 1.0])
            return message
        message.angle_min, message.angle_max = -message.angle_min, -message.angle_max
        message.angle_increment = -message.angle_increment
        return message

    return Changes(lidar=edit)


def _upside_down(_: Subject) -> Changes:
    def edit(message: Message) -> Message:
        _require_cloud(message)
        set_positions(message, positions(message) * [1.0, -1.0, -1.0])
        return message

    return Changes(lidar=edit)


def _ranges(new: Callable[[Array, np.random.Generator], Array]) -> Callable[[Subject], Changes]:
    def change(subject: Subject) -> Changes:
        def edit(message: Message) -> Message:
            change_ranges(message, lambda ranges: new(ranges, subject.rng))
            return message

        return Changes(lidar=edit)

    return change


def _in_millimetres(_: Subject) -> Changes:
    def edit(message: Message) -> Message:
        change_ranges(message, lambda ranges: MILLIMETRES * ranges)
        if is_scan(message):
            message.range_min, message.range_max = (
                MILLIMETRES * limit for limit in (message.range_min, message.range_max)
            )
        return message

    return Changes(lidar=edit)


def _shuffled(subject: Subject) -> Changes:
    """Put the points in a random order; the times stay where they were."""

    def edit(message: Message) -> Message:
        _require_cloud(message)
        rows = messages.table(message)
        name = messages.time_field(rows)
        mixed = rows[subject.rng.permutation(len(rows))]
        mixed[name] = rows[name]
        messages.set_table(message, mixed)
        return message

    return Changes(lidar=edit)


def _level(subject: Subject) -> Changes:
    def edit(message: Message) -> Message:
        _require_cloud(message)
        return level_scan(message, subject.standard_types)

    def payload(content: dict[str, Any]) -> None:
        content["lidar"]["kind"] = "generic"

    return Changes(payload=payload, lidar=edit)


def _require_cloud(message: Message) -> None:
    if is_scan(message):
        msg = "this fault needs the points of a 3D lidar, the recording has the scans of a 2D lidar"
        raise UsageError(msg)


FAULTS = (
    Fault(
        "lidar-mirrored",
        "The lidar's angles are negated, as if it turned the other way.",
        _mirrored,
        "mirrored",
        r"mirror|direction|(other|wrong) way|clockwise|upside|turn.*against",
    ),
    Fault(
        "lidar-upside-down",
        "The lidar hangs upside down, which the payload does not say (a 2D lidar is then mirrored).",
        _upside_down,
        "mount",
        r"mount|T_imu_lidar|T_motor_lidar|upside",
        SOLID,
    ),
    Fault(
        "ranges-1.3",
        "All ranges are 1.3 times too long.",
        _ranges(lambda ranges, _: 1.3 * ranges),
        "none",
        r"range.*(scale|factor|times|long|unit|%)|scale.*(range|lidar)",
    ),
    Fault(
        "ranges-millimetres",
        "The ranges are in millimetres.",
        _in_millimetres,
        "units",
        r"millimet|\bmm\b",
    ),
    Fault(
        "ranges-random",
        "The ranges are random.",
        _ranges(lambda ranges, rng: rng.uniform(NEAREST, FARTHEST, ranges.shape)),
        "none",
        r"range.*(random|noise|mean|no sense|nonsense|not (fit|agree|match))|"
        r"(lidar|points|scans?).*(no|not|nothing).*(surface|agree|match|fit)",
    ),
    Fault(
        "ranges-constant",
        "All ranges are 5 m.",
        _ranges(lambda ranges, _: np.full_like(ranges, CONSTANT)),
        "none",
        r"range.*(same|constant|equal|5(\.0)? m)|(same|constant|equal).*range|covered",
    ),
    Fault(
        "points-shuffled",
        "The points of every cloud are in a random order, with the times of others.",
        _shuffled,
        "none",
        r"point.*(order|time)|time.*point|shuffl|order.*point",
        SOLID,
    ),
    Fault(
        "lidar-level",
        "The lidar is a 2D lidar that stays level: one ring of the 3D lidar.",
        _level,
        "none",
        r"level|slice|scan plane",
        ("vlp16-fixed",),
    ),
)
