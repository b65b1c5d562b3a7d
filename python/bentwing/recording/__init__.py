# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings: files and the sensor head's description in, batches of samples in time order out."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.base.clock import Clock
    from bentwing.recording.batches import Batch, EncoderBatch, ImuBatch, LidarBatch
    from bentwing.recording.lidar_kinds import LidarKind
    from bentwing.recording.payload import Payload, PayloadLike
    from bentwing.recording.recording import Recording
    from bentwing.recording.sections.encoder import Encoder
    from bentwing.recording.sections.gnss import Gnss
    from bentwing.recording.sections.imu import Imu, ImuUnits
    from bentwing.recording.sections.lidar import Lidar
    from bentwing.recording.sections.section import Transform
    from bentwing.recording.sections.self_hits import Box, SelfHit
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "base.clock": ["Clock"],
            "recording.batches": ["Batch", "EncoderBatch", "ImuBatch", "LidarBatch"],
            "recording.lidar_kinds": ["LidarKind"],
            "recording.payload": ["Payload", "PayloadLike"],
            "recording.recording": ["Recording"],
            "recording.sections.encoder": ["Encoder"],
            "recording.sections.gnss": ["Gnss"],
            "recording.sections.imu": ["Imu", "ImuUnits"],
            "recording.sections.lidar": ["Lidar"],
            "recording.sections.section": ["Transform"],
            "recording.sections.self_hits": ["Box", "SelfHit"],
        },
    )

__all__ = [
    "Batch",
    "Box",
    "Clock",
    "Encoder",
    "EncoderBatch",
    "Gnss",
    "Imu",
    "ImuBatch",
    "ImuUnits",
    "Lidar",
    "LidarBatch",
    "LidarKind",
    "Payload",
    "PayloadLike",
    "Recording",
    "SelfHit",
    "Transform",
]
