# SPDX-License-Identifier: MIT OR Apache-2.0
"""A feed in the types of evalio."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from evalio._cpp import helpers  # the public interface has no way in for whole arrays
from evalio.types import SE3, ImuMeasurement, ImuParams, LidarMeasurement, LidarParams, Stamp

from benches.peers.scans import POINT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benches.peers.feed import Feed, Head

_TYPES = {
    "<f4": helpers.DataType.FLOAT32,
    "<u4": helpers.DataType.UINT32,
    "<u2": helpers.DataType.UINT16,
}
_FIELDS = [
    helpers.Field(name=name, datatype=_TYPES[kind.str], offset=offset)
    for name, (kind, offset) in POINT.fields.items()
]


def measurements(feed: Feed) -> Iterator[ImuMeasurement | LidarMeasurement]:
    """All samples in the order in which they become known."""
    scans, imu = feed.scans(), feed.imu
    for kind, i in feed.events():
        if kind == "imu":
            yield ImuMeasurement(Stamp.from_nsec(int(imu.stamps_ns[i])), imu.gyro[i], imu.accel[i])
        else:
            yield scan_measurement(feed.head.starts_ns[i], next(scans))


def scan_measurement(start_ns: int, scan: np.ndarray) -> LidarMeasurement:
    """One scan; where it is organised, its columns are filled in."""
    stamp, n = Stamp.from_nsec(start_ns), len(scan)
    about = helpers.PointCloudMetadata(
        stamp=stamp,
        width=n,
        height=1,
        point_step=POINT.itemsize,
        row_step=n * POINT.itemsize,
        is_bigendian=0,
        is_dense=1,
    )
    found = helpers.pc2_to_evalio(about, _FIELDS, scan.tobytes())
    helpers.fill_col_row_major(found)
    return found


def lidar_params(head: Head) -> LidarParams:
    """What evalio wants to know of the lidar."""
    return LidarParams(
        num_rows=head.rows,
        num_columns=head.columns,
        min_range=head.min_range,
        max_range=head.max_range,
        rate=1.0 / head.period,
    )


def imu_params(feed: Feed) -> ImuParams:
    """And of the IMU: its noise, and gravity in a frame with z up."""
    noise = feed.head.noise
    if not noise:
        return ImuParams.down()
    rate = 1e9 / float(np.median(np.diff(feed.imu.stamps_ns)))
    return ImuParams(
        gyro=noise["gyro_noise"],
        accel=noise["accel_noise"],
        gyro_bias=noise["gyro_bias_walk"],
        accel_bias=noise["accel_bias_walk"],
        gravity=np.array([0.0, 0.0, -9.80665]),
        rate=rate,
    )


def mount(head: Head) -> SE3:
    """The lidar seen from the body."""
    return SE3.from_mat(np.asfortranarray(head.T_body_lidar))
