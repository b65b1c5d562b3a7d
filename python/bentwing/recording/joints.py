# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which joints the encoder's topic holds, and whether it is clear which one turns the lidar."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

from bentwing.base.errors import RecordingError
from bentwing.recording.messages import wire

if TYPE_CHECKING:
    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo

# Messages that are looked at: drivers that share a topic each give joints of their own.
N_PEEKED = 200


def peek_joints(source: Source, topic: TopicInfo, joint: str | None) -> tuple[str, ...]:
    """Return the names of the joints in the first messages, in their order.

    Parameters
    ----------
    joint : that the payload names

    Raises
    ------
    RecordingError
        None of these is the joint that the payload names.
    """
    names: dict[str, None] = {}
    for _, _, raw in itertools.islice(source.messages({topic.name}), N_PEEKED):
        try:
            _, joints = wire.joints(raw, cdr=source.cdr)
        except wire.BrokenMessageError:
            continue
        names |= dict.fromkeys(joints.names)
    if joint is None or joint in names:
        return tuple(names)
    msg = (
        f"{topic.name}: the payload names the joint {joint}, which the messages do not have (they have "
        f"{', '.join(names) or 'no names'}); correct 'encoder: {{joint: ...}}' in the payload"
    )
    raise RecordingError(msg)


def unclear_joint(topic: TopicInfo, joints: tuple[str, ...]) -> str:
    """Return the sentence on several joints of which the payload names none."""
    return (
        f"{topic.name}: of the joints {', '.join(joints)} the first, {joints[0]}, is taken for the motor "
        "that turns the lidar; name the right one in the payload under 'encoder: {joint: ...}'"
    )
