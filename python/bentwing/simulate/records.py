# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the sensors send, before it becomes messages. Times are s since the recording's start."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

POINT = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "ring", "time"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f4"],
        "offsets": [0, 4, 8, 12, 16, 18],
        "itemsize": 22,
    }
)
"""A point as Velodyne's driver packs it."""


@dataclass(frozen=True, slots=True)
class ScanRecord:
    """One sweep of a 2D scanner; `stamp` is that of the first beam.

    Attributes
    ----------
    stamp, arrival : s, in the lidar's clock and when it was recorded
    angle_min, angle_increment : rad
    time_increment, scan_time : s
    ranges, intensities : (B,) float32, m; infinite without a return, NaN when lost
    range_min, range_max : m
    """

    stamp: float
    arrival: float
    angle_min: float
    angle_increment: float
    time_increment: float
    scan_time: float
    ranges: NDArray[np.float32]
    intensities: NDArray[np.float32]
    range_min: float
    range_max: float


@dataclass(frozen=True, slots=True)
class CloudRecord:
    """Returns of a multi-beam lidar; a point's time is relative to `stamp`.

    Attributes
    ----------
    stamp, arrival : s
    points : (N,) structured as `POINT`, or (H, W) as a driver packs whole revolutions
    """

    stamp: float
    arrival: float
    points: NDArray[np.void]


@dataclass(frozen=True, slots=True)
class ImuRecord:
    """One inertial sample: gyro (3,) rad/s, accel (3,) m/s²."""

    stamp: float
    arrival: float
    gyro: NDArray[np.float64]
    accel: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class EncoderRecord:
    """One angle of the motor, rad in [0, 2π)."""

    stamp: float
    arrival: float
    angle: float


@dataclass(frozen=True, slots=True)
class FixRecord:
    """A position of the GNSS antenna: deg, m above the ellipsoid; covariance (9,) m², ENU."""

    stamp: float
    arrival: float
    longitude: float
    latitude: float
    height: float
    covariance: NDArray[np.float64]


Record = ScanRecord | CloudRecord | ImuRecord | EncoderRecord | FixRecord
