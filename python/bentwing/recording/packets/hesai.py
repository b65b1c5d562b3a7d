# SPDX-License-Identifier: MIT OR Apache-2.0
"""The tables of Hesai's lidars: PandarXT-32 and -16, PandarQT-64, Pandar40P.

Sources: the user manuals (data structure, and channel distribution), and HesaiLidar_SDK_2.0 and
HesaiLidar_General_SDK for the orders of fields, firing times and nominal angles. The frame is that of
Hesai's driver: y to the front, x to the right, z up.
"""

from __future__ import annotations

import calendar
import csv
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import PayloadError, RecordingError
from bentwing.base.regular_file import require_regular
from bentwing.recording.packets.blocks import DATE, BlockModel

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_MOST_OF_ANGLES = 2**16  # bytes
DUAL = {0x39, 0x3B, 0x3C}  # return mode: last and strongest, first and last, first and strongest
QT_DUAL = {*DUAL, 0x05}
# Pandar40P: of channels 1 to 40, elevation and azimuth in degrees; nominal, each unit has its own.
P40_ELEVATIONS = (
    15.21, 11.36, 8.387, 5.385, 3.368, 2.356, 2.016, 1.679, 1.341, 1.003, 0.665, 0.328, -0.009, -0.347,
    -0.685, -1.023, -1.36, -1.7, -2.037, -2.372, -2.712, -3.047, -3.384, -3.722, -4.057, -4.392, -4.729,
    -5.063, -5.398, -5.733, -6.735, -7.731, -8.732, -9.557, -10.704, -11.678, -12.646, -13.602, -18.561,
    -24.569,
)  # fmt: skip
P40_AZIMUTHS = (*[-1.042] * 6, *[3.125, -5.208, -1.042] * 8, *[-1.042] * 10)
P40_FIRING_US = (
    -42.22, -28.47, -16.04, -3.62, -45.49, -31.74, -47.46, -54.67, -20.62, -33.71, -40.91, -8.19, -20.62,
    -27.16, -50.73, -8.19, -14.74, -36.98, -45.49, -52.7, -23.89, -31.74, -38.95, -11.47, -18.65, -25.19,
    -48.76, -6.23, -12.77, -35.01, -21.92, -9.5, -43.52, -29.77, -17.35, -4.92, -42.22, -28.47, -16.04,
    -3.62,
)  # fmt: skip
QT_ELEVATIONS = (
    -52.121, -49.785, -47.577, -45.477, -43.465, -41.528, -39.653, -37.831, -36.055, -34.32, -32.619,
    -30.95, -29.308, -27.69, -26.094, -24.517, -22.964, -21.42, -19.889, -18.372, -16.865, -15.368, -13.88,
    -12.399, -10.925, -9.457, -7.994, -6.535, -5.079, -3.626, -2.175, -0.725, 0.725, 2.175, 3.626, 5.079,
    6.534, 7.993, 9.456, 10.923, 12.397, 13.877, 15.365, 16.861, 18.368, 19.885, 21.415, 22.959, 24.524,
    26.101, 27.697, 29.315, 30.957, 32.627, 34.328, 36.064, 37.84, 39.662, 41.537, 43.475, 45.487, 47.587,
    49.795, 52.133,
)  # fmt: skip
QT_AZIMUTHS = (
    8.736, 8.314, 7.964, 7.669, 7.417, 7.198, 7.007, 6.838, 6.688, 6.554, 6.434, 6.326, 6.228, 6.14, 6.059,
    5.987, -5.27, -5.216, -5.167, -5.123, -5.083, -5.047, -5.016, -4.988, -4.963, -4.942, -4.924, -4.91,
    -4.898, -4.889, -4.884, -4.881, 5.493, 5.496, 5.502, 5.512, 5.525, 5.541, 5.561, 5.584, 5.611, 5.642,
    5.676, 5.716, 5.759, 5.808, 5.862, 5.921, -5.33, -5.396, -5.469, -5.55, -5.64, -5.74, -5.85, -5.974,
    -6.113, -6.269, -6.447, -6.651, -6.887, -7.163, -7.493, -7.892,
)  # fmt: skip
QT_FIRING_US = (
    2.31, 4.37, 6.43, 8.49, 10.54, 12.6, 14.66, 16.71, 19.16, 21.22, 23.28, 25.34, 27.39, 29.45, 31.5, 33.56,
    36.61, 38.67, 40.73, 42.78, 44.84, 46.9, 48.95, 51.01, 53.45, 55.52, 57.58, 59.63, 61.69, 63.74, 65.8,
    67.86, 70.9, 72.97, 75.02, 77.08, 79.14, 81.19, 83.25, 85.3, 87.75, 89.82, 91.87, 93.93, 95.98, 98.04,
    100.1, 102.15, 105.2, 107.26, 109.32, 111.38, 113.43, 115.49, 117.54, 119.6, 122.05, 124.11, 126.17,
    128.22, 130.28, 132.34, 134.39, 136.45,
)  # fmt: skip

_CHANNEL = [("distance", "<u2"), ("intensity", "u1"), ("confidence", "u1")]
_XT_TAIL = [
    ("status", "V10"), ("mode", "u1"), ("speed", "<u2"), ("date", DATE), ("us", "<u4"), ("factory", "u1"),
]  # fmt: skip
_QT_TAIL = [
    ("status", "V10"), ("speed", "<u2"), ("us", "<u4"), ("mode", "u1"), ("factory", "u1"), ("date", DATE),
]  # fmt: skip


def _headed(
    n_blocks: int, n_channels: int, tail: Sequence[tuple[str, object]]
) -> np.dtype[np.void]:
    block = [("azimuth", "<u2"), ("channels", _CHANNEL, (n_channels,))]
    return np.dtype([("head", "V12"), ("blocks", block, (n_blocks,)), *tail])


_P40 = np.dtype(
    [
        (
            "blocks",
            [("begin", "<u2"), ("azimuth", "<u2"), ("channels", _CHANNEL[:2], (40,))],
            (10,),
        ),
        ("status", "V8"), ("speed", "<u2"), ("us", "<u4"), ("mode", "u1"), ("factory", "u1"), ("date", DATE),
    ]
)  # fmt: skip


def find_model(packet: bytes, angles: str | None, topic: str) -> BlockModel:
    """Return the model that sent a packet.

    Parameters
    ----------
    angles : file with the unit's own angles, None for the nominal ones
    topic : for messages

    Raises
    ------
    RecordingError, PayloadError
        The model is none that can be read, or the file of angles cannot be used.
    """
    if packet[:2] == b"\xff\xee":
        model = _p40()
    elif packet[:4] == b"\xee\xff\x06\x01" and packet[6:8] in (b"\x20\x08", b"\x10\x08"):
        model = _xt(packet[6])
    elif packet[:4] == b"\xee\xff\x03\x01" and packet[6:8] == b"\x40\x04":
        model = _qt()
    else:
        version = ".".join(map(str, packet[2:4]))
        beams = packet[6] if len(packet) > 6 else 0
        msg = (
            f"{topic}: packets of a Hesai with {beams} channels and protocol {version}; those of PandarXT-32 "
            "and -16, PandarQT-64 and Pandar40P can be read: let its ROS driver make clouds "
            "(PointCloud2 with a time per point) of others"
        )
        raise RecordingError(msg)
    if angles is None:
        return model
    elevations, azimuths = _own_angles(Path(angles), len(model.rings))
    return replace(model, elevations=elevations, azimuths=azimuths)


def _xt(n_channels: int) -> BlockModel:
    # The sixteen channels of an XT-16 fire when every other one of an XT-32 does.
    every = 32 // n_channels
    block_us, before_us = 50.0, 5.632  # of the last block before the packet's stamp

    def stamp_us(one: np.void) -> float | None:
        n_firings = 8 // n_returns(one)
        return _stamp_us(one, before_us - block_us * (n_firings - 1) + 0.368)

    def n_returns(one: np.void) -> int:
        return 2 if int(one["mode"]) in DUAL else 1

    layout = _headed(8, n_channels, _XT_TAIL)
    return BlockModel(
        f"PandarXT-{n_channels}", layout, (layout.itemsize, layout.itemsize + 4), 0.004, block_us,
        0.368 + 1.512 * np.arange(0.0, 32.0, every), np.arange(15.0, -17.0, -every), np.zeros(n_channels),
        np.arange(n_channels, dtype=np.uint16), "y", 0.0, stamp_us, n_returns,
    )  # fmt: skip


def _qt() -> BlockModel:
    def stamp_us(one: np.void) -> float | None:
        return _stamp_us(one, 25.71 + QT_FIRING_US[0])

    def n_returns(one: np.void) -> int:
        return 2 if int(one["mode"]) in QT_DUAL else 1

    layout = _headed(4, 64, _QT_TAIL)
    return BlockModel(
        "PandarQT-64", layout, (layout.itemsize, layout.itemsize + 4), 0.004, 166.67,
        np.array(QT_FIRING_US), np.array(QT_ELEVATIONS), np.array(QT_AZIMUTHS),
        np.arange(64, dtype=np.uint16), "y", 0.0, stamp_us, n_returns,
    )  # fmt: skip


def _p40() -> BlockModel:
    block_us, before_us = 55.56, -28.58

    def stamp_us(one: np.void) -> float | None:
        n_firings = 10 // n_returns(one)
        first_us = before_us - block_us * (n_firings - 1) + min(P40_FIRING_US)
        return _stamp_us(one, first_us, knows_epoch=False)

    def n_returns(one: np.void) -> int:
        return 2 if int(one["mode"]) in DUAL else 1

    return BlockModel(
        "Pandar40P", _P40, (_P40.itemsize, _P40.itemsize + 4), 0.004, block_us,
        np.array(P40_FIRING_US), np.array(P40_ELEVATIONS), np.array(P40_AZIMUTHS),
        np.arange(40, dtype=np.uint16), "y", 0.0, stamp_us, n_returns,
    )  # fmt: skip


def _stamp_us(one: np.void, first_us: float, *, knows_epoch: bool = True) -> float | None:
    """Return the time of the first firing, which is `first_us` after the packet's stamp.

    Parameters
    ----------
    knows_epoch : the year 0 says that seconds since 1970 follow
    """
    year, month, day, hour, minute, second = (int(value) for value in one["date"])
    us = int(one["us"])
    if year == 0 and knows_epoch:  # whole seconds, big-endian, behind two zeros
        seconds = int.from_bytes(bytes([day, hour, minute, second]), "big")
    # A sensor without a source of time counts from an empty date.
    elif month > 12 or day > 31 or hour > 23 or minute > 59 or second > 60:
        return None
    else:
        century = 2000 if year < 70 else 1900
        date = (century + year, max(month, 1), max(day, 1), hour, minute, second)
        seconds = calendar.timegm(date)
    return None if us >= 1_000_000 else seconds * 1e6 + us + first_us


def _own_angles(path: Path, n_channels: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read a unit's angle correction file: Channel,Elevation,Azimuth in degrees.

    Raises
    ------
    PayloadError
        It cannot be read, or is not of this model.
    """
    advice = "give the angle correction file of the sensor, as PandarView or its web page saves it"
    require_regular(path, _MOST_OF_ANGLES, PayloadError)
    try:
        with path.open(encoding="utf-8-sig", newline="") as file:
            rows = [row for row in csv.reader(file) if row and row[0].strip().isdigit()]
        found = {int(row[0]): (float(row[1]), float(row[2])) for row in rows}
    except (OSError, UnicodeDecodeError, ValueError, IndexError) as error:
        msg = f"lidar.metadata: {path} cannot be read ({error}); {advice}"
        raise PayloadError(msg) from None
    if sorted(found) != list(range(1, n_channels + 1)):
        msg = f"lidar.metadata: {path} has {len(found)} channels, expected 1 to {n_channels}; {advice}"
        raise PayloadError(msg)
    table = np.array([found[channel] for channel in sorted(found)])
    if not (np.abs(table) <= 90).all():
        msg = f"lidar.metadata: {path} has angles beyond 90°; {advice}"
        raise PayloadError(msg)
    return table[:, 0].copy(), table[:, 1].copy()
