# SPDX-License-Identifier: MIT OR Apache-2.0
"""The tables of RoboSense's lidars: RS-16, RS-32, Helios and Airy.

Source: rs_driver of RoboSense, version 1.5.19 (orders of fields, firing times, lens). The angles of a unit's beams come in
packets of its own about the device, which drivers call DIFOP. The frame is that of RoboSense's driver: x
ahead, y to the left, z up.
"""

from __future__ import annotations

import calendar
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import RecordingError
from bentwing.recording.packets.blocks import BEGIN, DATE, BlockModel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.lidar_kinds import PacketModel, RobosenseModel

SIZE = 1248  # bytes of both kinds of packets
POINTS_V1, POINTS_V2 = b"\x55\xaa\x05\x0a", b"\x55\xaa\x05\x5a"
DEVICE = b"\xa5\xff\x00\x5a"
RETURNS_AT, ELEVATIONS_AT, AZIMUTHS_AT, RS16_AT = (
    300,
    468,
    564,
    1165,
)  # bytes of a packet of the device
N_BEAMS = 32
MOUNTING_AT, AIRY_AZIMUTHS_AT, AIRY_BEAMS = 289, 756, 96
NO_ANGLE = 0xFF  # as a sign

_RS16_US = tuple(2.8 * i for i in range(16))
_RS32_US = (
    *(2.88 * i for i in range(15)), 44.64, *(1.44 + 2.88 * i for i in range(15)), 46.08,
)  # fmt: skip
_HELIOS_US = tuple(1.73 * i for i in range(32))

# Groups of eight of an Airy's 96 channels, or of four of 48, by the mounting that the device states.
_AIRY_GROUPS_US = {
    0: (0.0, 5.712, 12.376, 19.04, 25.704, 33.32, 41.888, 50.456, 59.024, 70.448, 81.872, 93.296),
    1: (0.0, 11.424, 22.848, 34.272, 45.696, 54.264, 62.832, 71.4, 79.016, 85.68, 92.344, 99.008),
    2: (0.0, 7.616, 16.184, 24.752, 33.32, 42.84, 52.36, 61.88, 71.4, 79.968, 88.536, 97.104),
}
_AIRY_OTHER = 2  # also where it states none, and of 48 channels
_AIRY_MODES = {1: 48, 2: 96, 3: 192}  # channels; else 96
_AIRY_DUAL = 3  # of the returns in a packet

_CHANNEL = [("distance", ">u2"), ("intensity", "u1")]
_BLOCK = [("begin", "<u2"), ("azimuth", ">u2"), ("channels", _CHANNEL, (32,))]
_V1 = np.dtype(
    [
        ("head", "V20"), ("date", DATE), ("ms", ">u2"), ("us", ">u2"), ("rest", "V12"),
        ("blocks", _BLOCK, (12,)), ("tail", "V6"),
    ]
)  # fmt: skip
_V2 = np.dtype(
    [
        ("head", "V20"), ("high", ">u2"), ("seconds", ">u4"), ("us", ">u4"), ("rest", "V12"),
        ("blocks", _BLOCK, (12,)), ("tail", "V6"),
    ]
)  # fmt: skip

_AIRY_BLOCK = [("begin", "<u2"), ("azimuth", ">u2"), ("channels", _CHANNEL, (48,))]
_AIRY = np.dtype(
    [
        ("head", "V16"), ("what", "u1"), ("returns", "u1"), ("more", "V2"), ("high", ">u2"),
        ("seconds", ">u4"), ("us", ">u4"), ("type", "V2"), ("mode", "u1"), ("rest", "V9"),
        ("blocks", _AIRY_BLOCK, (8,)), ("tail", "V22"),
    ]
)  # fmt: skip


def find_model(
    packet: bytes, device: bytes | None, told: PacketModel | None, topic: str
) -> BlockModel:
    """Return the model that sent a packet, with the angles of its beams.

    Parameters
    ----------
    device : a packet about the device, None where the recording has none
    told : by the payload; packets of an RS-16 and an RS-32 look alike
    topic : for messages

    Raises
    ------
    RecordingError
        The model is none that can be read, is not told, or its angles are missing or damaged.
    """
    kind = _kind(packet, told, topic)
    if device is None:
        msg = (
            f"{topic}: packets of a RoboSense without those about the device (DIFOP, sent to port 7788), which "
            "have the angles of its beams; record them too"
        )
        raise RecordingError(msg)
    if kind == "airy":
        return _airy(packet, device, topic)
    is_dual = device[RETURNS_AT] == 0
    if kind == "rs16":
        return _rs16(_rs16_elevations(device, topic), is_dual=is_dual)
    firing_us, block_us, lens, unit, digits = {
        "rs32": (_RS32_US, 55.52, 0.03997, 0.005, 1e-3),
        "helios": (_HELIOS_US, 55.56, 0.03498, 0.0025, 1e-2),
    }[kind]
    elevations = _angles(device, ELEVATIONS_AT, digits, topic)
    azimuths = _angles(device, AZIMUTHS_AT, digits, topic)
    layout, stamp_us = (_V2, _stamp_v2) if kind == "helios" else (_V1, _stamp_v1)
    return BlockModel(
        kind, layout, (SIZE,), unit, block_us, np.array(firing_us), elevations, azimuths,
        _ranks(elevations), "x", lens, stamp_us, lambda _: 2 if is_dual else 1,
    )  # fmt: skip


def _kind(packet: bytes, told: PacketModel | None, topic: str) -> RobosenseModel:
    if packet[:4] == POINTS_V1:
        if told == "rs16" or told == "rs32":
            return told
        found, fitting = "an RS-16 or RS-32, which look alike", "rs16 or rs32"
    elif packet[:4] == POINTS_V2 and _is_of_blocks(packet, _V2):
        if told in (None, "helios"):
            return "helios"
        found, fitting = "a Helios", "helios"
    elif packet[:4] == POINTS_V2 and _is_of_blocks(packet, _AIRY):
        if told in (None, "airy"):
            return "airy"
        found, fitting = "an Airy", "airy"
    else:
        msg = (
            f"{topic}: packets of a RoboSense of another model than RS-16, RS-32, Helios and Airy; let its ROS "
            "driver make clouds (PointCloud2 with a time per point) of them"
        )
        raise RecordingError(msg)
    says = "" if told is None else f", but the payload says 'model: {told}'"
    msg = (
        f"{topic}: packets of {found}{says}; say in the payload 'lidar: {{model: ...}}' ({fitting})"
    )
    raise RecordingError(msg)


def _is_of_blocks(packet: bytes, layout: np.dtype[np.void]) -> bool:
    """Whether the blocks of a packet are where a layout has them; models share their first bytes."""
    is_whole = len(packet) == layout.itemsize
    return is_whole and bool(
        (np.frombuffer(packet, layout, 1)[0]["blocks"]["begin"] == BEGIN).all()
    )


def _airy(packet: bytes, device: bytes, topic: str) -> BlockModel:
    """Return the table of an Airy, whose firings of 96 channels fill two blocks."""
    n_channels = _AIRY_MODES.get(int(np.frombuffer(packet, _AIRY, 1)[0]["mode"]), AIRY_BEAMS)
    if n_channels > AIRY_BEAMS:
        msg = (
            f"{topic}: packets of an Airy with {n_channels} channels, which cannot be read; let its ROS driver make "
            "clouds (PointCloud2 with a time per point) of them"
        )
        raise RecordingError(msg)
    mounting = device[MOUNTING_AT] if n_channels == AIRY_BEAMS else _AIRY_OTHER
    groups_us = _AIRY_GROUPS_US.get(mounting, _AIRY_GROUPS_US[_AIRY_OTHER])
    firing_us = np.repeat(groups_us, n_channels // len(groups_us))
    elevations = _angles(device, ELEVATIONS_AT, 1e-2, topic, n_channels)
    azimuths = _angles(device, AIRY_AZIMUTHS_AT, 1e-2, topic, n_channels)

    def stamp_us(one: np.void) -> float | None:
        return None if one["what"] else _stamp_v2(one)  # others are no points

    return BlockModel(
        "airy", _AIRY, (SIZE,), 0.005, 111.08, firing_us, elevations, azimuths, _ranks(elevations), "x",
        float(np.hypot(0.0075, 0.00664)), stamp_us, lambda one: 2 if one["returns"] == _AIRY_DUAL else 1,
        blocks_of_return=n_channels // 48, range_bits=0x3FFF, height=0.04532,
    )  # fmt: skip


def _rs16(elevations: NDArray[np.float64], *, is_dual: bool) -> BlockModel:
    """Return the table of an RS-16, whose blocks have two firings, or one firing with two returns."""
    n_firings = 1 if is_dual else 2
    firing_us = np.concatenate([np.array(_RS16_US) + 55.5 * i for i in range(n_firings)])
    return BlockModel(
        "rs16", _V1, (SIZE,), 0.005, 55.5 * n_firings, firing_us, np.tile(elevations, n_firings),
        np.zeros(len(firing_us)), np.tile(_ranks(elevations), n_firings), "x", 0.03825, _stamp_v1,
        lambda _: 1, returns_in_block=2 if is_dual else 1,
    )  # fmt: skip


def _rs16_elevations(device: bytes, topic: str) -> NDArray[np.float64]:
    raw = np.frombuffer(device, "u1", 48, RS16_AT).reshape(16, 3).astype(np.float64)
    size = raw @ [65536, 256, 1] * 1e-4
    sign = np.where(np.arange(16) < 8, -1.0, 1.0)
    return _checked(sign * size, topic)


def _angles(
    device: bytes, at: int, digits: float, topic: str, n_beams: int = N_BEAMS
) -> NDArray[np.float64]:
    table = np.frombuffer(device, [("sign", "u1"), ("size", ">u2")], n_beams, at)
    if (table["sign"] == NO_ANGLE).any():
        return _checked(np.full(n_beams, np.nan), topic)
    return _checked(np.where(table["sign"] == 0, 1.0, -1.0) * table["size"] * digits, topic)


def _checked(angles: NDArray[np.float64], topic: str) -> NDArray[np.float64]:
    if not (np.abs(angles) <= 90).all():
        msg = (
            f"{topic}: the packets about the device (DIFOP) have no angles of beams of this model; check "
            "'lidar: {model: ...}' in the payload, or let its ROS driver make clouds"
        )
        raise RecordingError(msg)
    return angles


def _ranks(elevations: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Return the number of each channel from below, as the driver counts them."""
    below = elevations[None, :] < elevations[:, None]
    return np.asarray(below.sum(axis=1), np.uint16)


def _stamp_v1(one: np.void) -> float | None:
    year, month, day, hour, minute, second = (int(value) for value in one["date"])
    ms, us = int(one["ms"]), int(one["us"])
    # A sensor without a source of time counts from an empty date.
    if month > 12 or day > 31 or hour > 23 or minute > 59 or second > 60 or max(ms, us) > 999:
        return None
    date = (2000 + year, max(month, 1), max(day, 1), hour, minute, second)
    return calendar.timegm(date) * 1e6 + ms * 1e3 + us


def _stamp_v2(one: np.void) -> float | None:
    us = int(one["us"])
    if one["high"] or us >= 1_000_000:
        return None
    return float(int(one["seconds"]) * 1e6 + us)
