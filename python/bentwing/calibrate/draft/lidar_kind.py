# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which lidar it is, by the type of its messages, its names, its beams and its reach."""

from __future__ import annotations

import itertools
from collections import Counter
from contextlib import suppress
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.recording.messages.lidar_messages import LIDAR_MESSAGES, is_planar
from bentwing.recording.messages.wire import BrokenMessageError
from bentwing.recording.topics import HESAI_TYPES, OUSTER_TYPES, ROBOSENSE_TYPES

if TYPE_CHECKING:
    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.lidar_kinds import LidarKind
    from bentwing.recording.messages.wire_scans import RawScan

# Parts of topics' names by which drivers call their lidars.
NAMES: dict[str, LidarKind] = {
    "ouster": "ouster",
    "os_cloud": "ouster",
    "os1": "ouster",
    "livox": "livox",
    "mid360": "livox",
    "avia": "livox",
    "hesai": "hesai",
    "pandar": "hesai",
    "rslidar": "robosense",
    "helios": "robosense",
    "vlp16": "vlp16",
    "puck": "vlp16",
}
UTM30LX_FIELD, UTM30LX_REACH = np.radians(270.0), (30.0, 60.0)  # m, by the driver
VLP16_BEAMS = 16
N_LOOKED_AT = 5  # messages


def describe_lidar(source: Source, topic: TopicInfo) -> dict[str, Any]:
    """Return the section `lidar` of a payload, with what can be told of the lidar on a topic."""
    described: dict[str, Any] = {"topic": topic.name}
    kind = _by_name(topic)
    if kind is None and topic.type in LIDAR_MESSAGES:
        messages = _first_messages(source, topic)
        if is_planar(topic.type):
            return described | _of_scans(messages)
        if any(_n_beams(message) == VLP16_BEAMS for message in messages):
            kind = "vlp16"
    return described if kind is None else described | {"kind": kind}


def _by_name(topic: TopicInfo) -> LidarKind | None:
    if topic.type in OUSTER_TYPES:
        return "ouster"
    if topic.type in HESAI_TYPES:
        return "hesai"
    if topic.type in ROBOSENSE_TYPES:
        return "robosense"
    if "livox" in topic.type:
        return "livox"
    name = topic.name.lower().replace("-", "").replace("_", "")
    return next((kind for part, kind in NAMES.items() if part.replace("_", "") in name), None)


def _first_messages(source: Source, topic: TopicInfo) -> list[Any]:
    decoder = LIDAR_MESSAGES[topic.type](cdr=source.cdr)
    found = []
    for _, _, raw in itertools.islice(source.messages({topic.name}), N_LOOKED_AT):
        with suppress(BrokenMessageError):
            found.append(decoder.parse(raw, Counter()))
    return found


def _of_scans(scans: list[RawScan]) -> dict[str, Any]:
    """Return kind, or the range of a 2D lidar that is none of the known ones."""
    if not scans:
        return {}
    first = scans[0]
    field = abs(first.angle_increment) * (len(first.ranges) - 1)
    low, high = UTM30LX_REACH
    if abs(field - UTM30LX_FIELD) < np.radians(1.0) and low <= first.range_max <= high:
        return {"kind": "hokuyo-utm30lx"}
    if not 0 < first.range_min < first.range_max < np.inf:
        return {}
    rounded = (float(f"{one:.4g}") for one in (first.range_min, first.range_max))
    return dict(zip(("min_range", "max_range"), rounded, strict=True))


def _n_beams(cloud: Any) -> int:  # noqa: ANN401 - any message
    ring = getattr(getattr(cloud, "columns", None), "ring", None)
    return 0 if ring is None else len(np.unique(ring))
