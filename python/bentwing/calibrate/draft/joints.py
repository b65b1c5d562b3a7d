# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which joint of a JointState topic turns, as that of a lidar's motor does."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.recording.messages import wire

if TYPE_CHECKING:
    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo

MIN_TRAVEL = 1.0  # of either unit, over the recording; a joint that holds its place makes less


def turning_joint(source: Source, topic: TopicInfo) -> dict[str, str] | None:
    """Return what to say of the joint that travels farthest, None where none turns.

    Of a single joint there is nothing to say.
    """
    travel: dict[str, float] = {}
    last: dict[str, float] = {}
    for _, _, raw in source.messages({topic.name}):
        try:
            _, joints = wire.joints(raw, cdr=source.cdr)
        except wire.BrokenMessageError:
            continue
        names = joints.names or ("",) * len(joints.positions)
        for name, position in zip(names, joints.positions, strict=False):
            step = abs(position - last.get(name, position))
            travel[name] = travel.get(name, 0.0) + step
            last[name] = position
    farthest = max(travel, key=lambda name: travel[name], default="")
    if travel.get(farthest, 0.0) < MIN_TRAVEL:
        return None
    return {"joint": farthest} if len(travel) > 1 else {}
