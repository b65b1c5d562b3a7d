# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings read whole."""

from __future__ import annotations

import numpy as np

from bentwing.recording import EncoderBatch, ImuBatch, LidarBatch, Payload, Recording

HEAD = Payload(T_imu_lidar={})
NO_IMU = Payload(imu=None)


def read(path, payload=HEAD, **part):
    """Return the batches of a recording by kind, and the recording."""
    with Recording(path, payload) as recording:
        batches = list(recording.batches(**part))
    kinds = (LidarBatch, ImuBatch, EncoderBatch)
    return [[b for b in batches if isinstance(b, kind)] for kind in kinds], recording


def joined(batches, name):
    return np.concatenate([getattr(batch, name) for batch in batches])
