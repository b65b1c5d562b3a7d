# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings: files and the sensor head's description in, batches of samples in time order out."""

from bentwing.base.clock import Clock
from bentwing.recording.batches import Batch, EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.payload import Payload
from bentwing.recording.recording import Recording

__all__ = ["Batch", "Clock", "EncoderBatch", "ImuBatch", "LidarBatch", "Payload", "Recording"]
