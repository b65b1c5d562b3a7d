# SPDX-License-Identifier: MIT OR Apache-2.0
"""An Ouster's packets of a wall that is known."""

from __future__ import annotations

import json
import struct

import numpy as np
import pytest

core = pytest.importorskip(
    "ouster.sdk.core", reason="needs pip install --no-deps ouster-sdk==0.16.2"
)

BOOTED_NS = 1_622_000_000_000  # of a sensor whose clock was never set
N_COLUMNS, N_BEAMS, COLUMN_NS = 1024, 32, 97_656
ELEVATIONS_DEG = np.linspace(16.6, -16.6, N_BEAMS).round(3)
AZIMUTHS_DEG = np.tile([3.16, 1.05, -1.05, -3.16], N_BEAMS // 4)
METADATA = json.dumps(
    {
        "prod_sn": "123", "build_rev": "v1.13.0", "prod_line": "OS-1-32",
        "lidar_mode": "1024x10", "lidar_origin_to_beam_origin_mm": 0.0,
        "beam_altitude_angles": ELEVATIONS_DEG.tolist(),
        "beam_azimuth_angles": AZIMUTHS_DEG.tolist(),
        "imu_to_sensor_transform": [1, 0, 0, 6.253, 0, 1, 0, -11.775, 0, 0, 1, 7.645, 0, 0, 0, 1],
        "lidar_to_sensor_transform": [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 36.18, 0, 0, 0, 1],
        "data_format": {
            "columns_per_frame": N_COLUMNS, "columns_per_packet": 16, "pixels_per_column": N_BEAMS,
            "column_window": [0, N_COLUMNS - 1], "pixel_shift_by_row": [0] * N_BEAMS,
        },
    }
)  # fmt: skip
MOUNT = {"translation": (-0.006253, 0.011775, 0.028535), "quaternion": (0.0, 0.0, 1.0, 0.0)}


def ranges_to_wall(columns):
    """(32, N) mm to the wall x = 4 m, and nothing beyond 60° to the sides."""
    turned = 2 * np.pi * (1 - columns / N_COLUMNS) - np.radians(AZIMUTHS_DEG)[:, None]
    slant = np.cos(turned) * np.cos(np.radians(ELEVATIONS_DEG))[:, None]
    return np.where(np.cos(turned) > 0.5, np.rint(4000 / slant), 0).astype(np.uint32)


def lidar_packets(duration, *, first_ns=BOOTED_NS):
    """(ns since the first packet, packet)."""
    info = core.SensorInfo(METADATA)
    writer = core.PacketWriter.from_info(info)
    found = []
    for first in range(0, int(duration * 1e9 / COLUMN_NS), 16):
        packet = core.LidarPacket(writer.lidar_packet_size)
        columns = (first + np.arange(16)) % N_COLUMNS
        writer.set_frame_id(packet, 40 + first // N_COLUMNS)
        for i, column in enumerate(columns):
            writer.set_col_timestamp(packet, i, first_ns + (first + i) * COLUMN_NS)
            writer.set_col_measurement_id(packet, i, int(column))
            writer.set_col_status(packet, i, 0xFFFFFFFF)
        writer.set_field(packet, "RANGE", ranges_to_wall(columns))
        writer.set_field(packet, "SIGNAL", np.full((N_BEAMS, 16), 77, np.uint16))
        found.append((first * COLUMN_NS, packet.buf.tobytes()))
    return found


def imu_packets(duration, *, first_ns=BOOTED_NS):
    """(ns since the first packet, packet) with 1 g upwards and 90 °/s about x."""
    times = range(0, int(duration * 1e9), 10_000_000)
    return [
        (t, struct.pack("<QQQ6f", 7, first_ns + t - 220_000, first_ns + t, 0, 0, 1, 90, 0, 0))
        for t in times
    ]
