# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings: files and the sensor head's description in, batches of samples in time order out."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.base.clock import Clock
    from bentwing.recording.batches import Batch, EncoderBatch, ImuBatch, LidarBatch
    from bentwing.recording.lidar_kinds import LidarKind
    from bentwing.recording.payload import (
        Box,
        Encoder,
        Gnss,
        Imu,
        Lidar,
        Payload,
        PayloadLike,
        SelfHit,
        Transform,
    )
    from bentwing.recording.recording import Recording
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "base.clock": ["Clock"],
            "recording.batches": ["Batch", "EncoderBatch", "ImuBatch", "LidarBatch"],
            "recording.lidar_kinds": ["LidarKind"],
            "recording.payload": [
                "Box",
                "Encoder",
                "Gnss",
                "Imu",
                "Lidar",
                "Payload",
                "PayloadLike",
                "SelfHit",
                "Transform",
            ],
            "recording.recording": ["Recording"],
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
    "Lidar",
    "LidarBatch",
    "LidarKind",
    "Payload",
    "PayloadLike",
    "Recording",
    "SelfHit",
    "Transform",
]
