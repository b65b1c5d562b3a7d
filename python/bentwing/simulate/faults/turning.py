# SPDX-License-Identifier: MIT OR Apache-2.0
"""Encoders of a turned lidar that count otherwise than payload.yaml says."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.simulate.faults.fault import TURNED, Changes, Fault, Subject
from bentwing.simulate.faults.messages import NS_PER_S, set_stamp, stamp_ns

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.faults.fault import Message

    Array = NDArray[np.float64]

TURNED_BY = 0.5
DELAY_NS = 20 * NS_PER_S // 1000
WHEEL_RATE = 0.4
"""rad/s of a joint that has nothing to do with the lidar."""

_ENCODER = r"encoder|motor|joint"


def _angles(new: Callable[[Array], Array]) -> Callable[[Subject], Changes]:
    def edit(message: Message) -> Message:
        message.position = new(message.position)
        return message

    return lambda _: Changes(encoder=edit)


def _delayed(_: Subject) -> Changes:
    def edit(message: Message) -> Message:
        set_stamp(message, stamp_ns(message) + DELAY_NS)
        return message

    return Changes(encoder=edit)


def _other_axis(_: Subject) -> Changes:
    """Put the motor's axis where the next one of its frame is."""

    def payload(content: dict[str, Any]) -> None:
        if "axis" not in content.get("encoder", {}):
            msg = "the payload describes no motor's axis that this fault could change"
            raise UsageError(msg)
        content["encoder"]["axis"] = np.roll(content["encoder"]["axis"], 1).tolist()

    return Changes(payload=payload)


def _second(subject: Subject) -> Changes:
    origin = subject.reader.start_time

    def edit(message: Message) -> Message:
        wheel = WHEEL_RATE * 1e-9 * (stamp_ns(message) - origin)
        message.name = ["wheel", *message.name]
        message.position = np.array([wheel, *message.position])
        return message

    return Changes(encoder=edit)


FAULTS = (
    Fault(
        "encoder-degrees",
        "The encoder is in degrees.",
        _angles(np.degrees),
        "encoder",
        rf"({_ENCODER}).*(deg|°)",
        TURNED,
    ),
    Fault(
        "encoder-negated",
        "The encoder counts the other way.",
        _angles(np.negative),
        "encoder",
        rf"({_ENCODER}).*(sign|negat|direction|other way|against|axis)",
        TURNED,
    ),
    Fault(
        "encoder-turned",
        "The encoder reads 0.5 rad too much.",
        _angles(lambda angles: angles + TURNED_BY),
        "encoder",
        rf"({_ENCODER}).*(zero|offset|turned|rad|°)",
        TURNED,
    ),
    Fault(
        "encoder-late",
        "The stamps of the encoder are 20 ms too late.",
        _delayed,
        "encoder",
        rf"({_ENCODER}).*(late|delay|clock|stamp|time)",
        TURNED,
    ),
    Fault(
        "encoder-axis",
        "The payload has the motor's axis along another axis of its frame.",
        _other_axis,
        "encoder",
        rf"({_ENCODER}).*axis|axis.*({_ENCODER})",
        TURNED,
    ),
    Fault(
        "encoder-second",
        "The JointState has another joint before the one that turns the lidar.",
        _second,
        "encoder",
        r"joint|encoder",
        TURNED,
    ),
)
