# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the lidar is on the IMU by a recording's tf: the frames of both topics, and the way between."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import yaml

from bentwing.base.errors import PayloadError
from bentwing.recording.frames import Frames
from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES
from bentwing.recording.messages.wire import BrokenMessageError, frame_id
from bentwing.recording.topics import IMU, VELODYNE_SCAN

if TYPE_CHECKING:
    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.sections.section import Transform

WITH_HEADER = (*LIDAR_MESSAGES, IMU, VELODYNE_SCAN)


@dataclass(frozen=True, slots=True)
class TfMount:
    """What /tf_static says of the lidar's pose on the IMU.

    Attributes
    ----------
    sentence : what was found, or why nothing
    line : for payload.yaml, empty where nothing was found
    T_imu_lidar : None where nothing was found
    """

    sentence: str
    line: str = ""
    T_imu_lidar: Transform | None = None


def tf_mount(source: Source, lidar: TopicInfo, imu: TopicInfo) -> TfMount | None:
    """Return what /tf_static says of the lidar on the IMU; None without it or without frames."""
    frames = Frames(source)
    child, parent = (_frame_of(source, topic) for topic in (lidar, imu))
    if not (frames.has_static and child and parent):
        return None
    try:
        through = frames.chain(parent, child)[1:-1]
        found = frames.between(parent, child)
    except PayloadError as error:
        return TfMount(f"/tf_static does not place the lidar on the IMU: {error}")
    x, y, z = (f"{value:.4f}" for value in found.translation)
    way = f" through {', '.join(through)}" if through else ""
    sentence = (
        f"/tf_static has the pose of the lidar ({child}) in the IMU's frame ({parent}){way}, which "
        f"takes points of the lidar to the IMU: its origin is at ({x} {y} {z}) m"
    )
    return TfMount(sentence, _line(parent, child), found)


def _frame_of(source: Source, topic: TopicInfo) -> str:
    """Return the frame of a topic's first message, empty without one."""
    if topic.type not in WITH_HEADER:
        return ""
    raw = next((raw for _, _, raw in source.messages({topic.name})), b"")
    try:
        return frame_id(raw, cdr=source.cdr)
    except BrokenMessageError:
        return ""


def _line(parent: str, child: str) -> str:
    reference = {"from_tf": {"parent": parent, "child": child}}
    text = yaml.safe_dump(
        reference, default_flow_style=True, width=float("inf"), sort_keys=False, allow_unicode=True
    )
    return f"T_imu_lidar: {text.strip()}"
