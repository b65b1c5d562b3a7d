# SPDX-License-Identifier: MIT OR Apache-2.0
"""Packets of turning lidars of Hesai and RoboSense before a wall, written from the makers' descriptions.

One channel after the other, as the manuals count them, and in their units.
"""

from __future__ import annotations

import math
import struct
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.recording.packets import hesai

if TYPE_CHECKING:
    from collections.abc import Callable

TURN_US = 100_000.0  # ten turns per second
WALL = 4.0  # m ahead
RS_ELEVATIONS = {
    "rs16": [-15 + 2 * i for i in range(8)] + [15 - 2 * i for i in range(8)],
    "rs32": [-25 + 1.25 * i for i in range(32)],
    "helios": [15 - 2.19 * i for i in range(32)],
    # up to 90° in truth, but there the wall is too far
    "airy": [0.75 * i for i in range(96)],
}
# of an Airy that is mounted on its side
AIRY_US = [0.0, 11.424, 22.848, 34.272, 45.696, 54.264, 62.832, 71.4, 79.016, 85.68, 92.344, 99.008]
RS_AZIMUTHS = {"rs16": [0.0] * 16, "rs32": [3.6 * (-1) ** i for i in range(32)],
               "helios": [1.2 * (i % 4) for i in range(32)], "airy": [2.4 * (i % 8) - 8 for i in range(96)]}  # fmt: skip


@dataclass(frozen=True)
class Channel:
    """Where and when a channel looks: degrees, and µs after its block begins."""

    elevation: float
    azimuth: float
    after_us: float


@dataclass(frozen=True)
class Lidar:
    """A model as its manual describes it; times in µs."""

    channels: list[Channel]
    block_us: float
    n_blocks: int
    unit: float
    lens: float
    stamp_before_us: Callable[[int], float]  # from the first block of n firings back to the stamp
    write: Callable[..., bytes]
    height: float = 0.0  # of where the rays begin

    def firing(self, begin_us: float, scene) -> list[tuple[int, int]]:
        """(distance in units, intensity) of all channels of a block that begins then."""
        found = []
        for channel in self.channels:
            rotor = math.radians(360 * (begin_us + channel.after_us) / TURN_US)
            look = rotor + math.radians(channel.azimuth)
            level = scene(rotor, look, self.lens)
            distance = level / math.cos(math.radians(channel.elevation))
            found.append((round(distance / self.unit), 40))
        return found


def wall(rotor: float, look: float, lens: float) -> float:
    """Level distance to the wall, and nothing beyond 60° to the sides."""
    return (WALL - lens * math.cos(rotor)) / math.cos(look) if math.cos(look) > 0.5 else 0.0


def packets_of(
    lidar: Lidar, start_us: int, n: int, *, scene=wall, weak=None
) -> list[tuple[float, bytes]]:
    """(µs of its first block since the start, packet); `weak` are ranges of a first, weaker return."""
    n_firings = lidar.n_blocks // (1 if weak is None else 2)
    found = []
    for number in range(n):
        begins = [(number * n_firings + i) * lidar.block_us for i in range(n_firings)]
        blocks = []
        for begin in begins:
            azimuth = round(36000 * begin / TURN_US) % 36000
            strong = lidar.firing(begin, scene)
            if weak is not None:
                blocks.append((azimuth, [(round(weak / lidar.unit), 5)] * len(strong)))
            blocks.append((azimuth, strong))
        stamp_us = start_us + begins[0] - lidar.stamp_before_us(n_firings)
        found.append((begins[0], lidar.write(round(stamp_us), blocks, is_dual=weak is not None)))
    return found


def _date(stamp_us: int) -> tuple[time.struct_time, int]:
    seconds, us = divmod(stamp_us, 1_000_000)
    return time.gmtime(seconds), us


def _hesai_date(date: time.struct_time) -> bytes:
    return bytes(
        [date.tm_year - 1900, date.tm_mon, date.tm_mday, date.tm_hour, date.tm_min, date.tm_sec]
    )


def _xt(stamp_us, blocks, *, is_dual):
    date, us = _date(stamp_us)
    head = b"\xee\xff\x06\x01\0\0" + bytes([len(blocks[0][1]), 8, 0, 4, 1 + is_dual, 1])
    body = b"".join(
        struct.pack("<H", azimuth) + b"".join(struct.pack("<HBB", d, i, 0) for d, i in channels)
        for azimuth, channels in blocks
    )
    mode = b"\x39" if is_dual else b"\x37"
    return (
        head
        + body
        + bytes(10)
        + mode
        + struct.pack("<H", 600)
        + _hesai_date(date)
        + struct.pack("<IBI", us, 0, 7)
    )


def _qt(stamp_us, blocks, *, is_dual):
    date, us = _date(stamp_us)
    head = b"\xee\xff\x03\x01\0\0" + bytes([64, 4, 0, 4, 1 + is_dual, 1])
    body = b"".join(
        struct.pack("<H", azimuth) + b"".join(struct.pack("<HBB", d, i, 0) for d, i in channels)
        for azimuth, channels in blocks
    )
    mode = 0x39 if is_dual else 0x37
    return (
        head
        + body
        + bytes(10)
        + struct.pack("<HIBB", 600, us, mode, 0)
        + _hesai_date(date)
        + bytes(4)
    )


def _p40(stamp_us, blocks, *, is_dual):
    date, us = _date(stamp_us)
    body = b"".join(
        b"\xff\xee"
        + struct.pack("<H", azimuth)
        + b"".join(struct.pack("<HB", d, i) for d, i in channels)
        for azimuth, channels in blocks
    )
    mode = 0x39 if is_dual else 0x37
    return body + bytes(8) + struct.pack("<HIBB", 600, us, mode, 0) + _hesai_date(date)


def _rs_body(blocks) -> bytes:
    return b"".join(
        b"\xff\xee"
        + struct.pack(">H", azimuth)
        + b"".join(struct.pack(">HB", d, i) for d, i in channels)
        for azimuth, channels in blocks
    )


def _rs_v1(stamp_us, blocks, *, is_dual):
    del is_dual  # the packet does not tell
    date, us = _date(stamp_us)
    day = bytes(
        [date.tm_year - 2000, date.tm_mon, date.tm_mday, date.tm_hour, date.tm_min, date.tm_sec]
    )
    head = (
        b"\x55\xaa\x05\x0a\x5a\xa5\x50\xa0"
        + bytes(12)
        + day
        + struct.pack(">HH", *divmod(us, 1000))
        + bytes(12)
    )
    return head + _rs_body(blocks) + bytes(6)


def _rs_v2(stamp_us, blocks, *, is_dual):
    del is_dual
    seconds, us = divmod(stamp_us, 1_000_000)
    head = (
        b"\x55\xaa\x05\x5a"
        + bytes(16)
        + seconds.to_bytes(6, "big")
        + us.to_bytes(4, "big")
        + bytes(12)
    )
    return head + _rs_body(blocks) + bytes(6)


def _airy(stamp_us, blocks, *, is_dual):
    """Of each firing two blocks with 48 channels; two flags stand above the bits of a distance."""
    seconds, us = divmod(stamp_us, 1_000_000)
    what = bytes([0, 3 if is_dual else 4, 0, 0])
    head = b"\x55\xaa\x05\x5a" + bytes(12) + what
    head += seconds.to_bytes(6, "big") + us.to_bytes(4, "big") + bytes([0, 1, 2]) + bytes(9)
    halves = [
        (azimuth, [(d | (at + i) % 4 << 14, s) for i, (d, s) in enumerate(channels[at : at + 48])])
        for azimuth, channels in blocks
        for at in (0, 48)
    ]
    return head + _rs_body(halves) + bytes(22)


def device_packet(model: str, *, is_dual: bool = False) -> bytes:
    """RoboSense's packet about the device, with the angles of its beams."""
    packet = bytearray(1248)
    packet[:8] = b"\xa5\xff\x00\x5a\x11\x11\x55\x55"
    packet[300] = 0 if is_dual else 1
    packet[289] = 1
    for i, (elevation, azimuth) in enumerate(
        zip(RS_ELEVATIONS[model], RS_AZIMUTHS[model], strict=True)
    ):
        if model == "rs16":
            packet[1165 + 3 * i : 1168 + 3 * i] = round(abs(elevation) * 10_000).to_bytes(3, "big")
        else:
            digits = 1000 if model == "rs32" else 100
            second = 756 if model == "airy" else 564
            for at, angle in ((468, elevation), (second, azimuth)):
                struct.pack_into(">BH", packet, at + 3 * i, angle < 0, round(abs(angle) * digits))
    return bytes(packet)


def _rs(model: str, after: list[float], block_us: float, unit: float, lens: float, write) -> Lidar:
    channels = [
        Channel(
            RS_ELEVATIONS[model][i % len(RS_ELEVATIONS[model])],
            RS_AZIMUTHS[model][i % len(RS_AZIMUTHS[model])],
            us,
        )
        for i, us in enumerate(after)
    ]
    return Lidar(channels, block_us, 12, unit, lens, lambda _: 0.0, write)


LIDARS = {
    "xt32": Lidar([Channel(15 - i, 0.0, 0.368 + 1.512 * i) for i in range(32)], 50.0, 8, 0.004, 0.0,
                  lambda n: 5.632 - 50.0 * (n - 1), _xt),
    "xt16": Lidar([Channel(15 - 2 * i, 0.0, 0.368 + 3.024 * i) for i in range(16)], 50.0, 8, 0.004, 0.0,
                  lambda n: 5.632 - 50.0 * (n - 1), _xt),
    "qt64": Lidar([Channel(*one) for one in zip(hesai.QT_ELEVATIONS, hesai.QT_AZIMUTHS, hesai.QT_FIRING_US, strict=True)],
                  166.67, 4, 0.004, 0.0, lambda _: 25.71, _qt),
    "40p": Lidar([Channel(*one) for one in zip(hesai.P40_ELEVATIONS, hesai.P40_AZIMUTHS, hesai.P40_FIRING_US, strict=True)],
                 55.56, 10, 0.004, 0.0, lambda n: -28.58 - 55.56 * (n - 1), _p40),
    "rs16": _rs("rs16", [2.8 * (i % 16) + 55.5 * (i // 16) for i in range(32)], 111.0, 0.005, 0.03825, _rs_v1),
    "rs32": _rs("rs32", [*(2.88 * i for i in range(15)), 44.64, *(1.44 + 2.88 * i for i in range(15)), 46.08],
                55.52, 0.005, 0.03997, _rs_v1),
    "helios": _rs("helios", [1.73 * i for i in range(32)], 55.56, 0.0025, 0.03498, _rs_v2),
    "airy": Lidar([Channel(RS_ELEVATIONS["airy"][i], RS_AZIMUTHS["airy"][i], AIRY_US[i // 8]) for i in range(96)],
                  111.08, 4, 0.005, math.hypot(0.0075, 0.00664), lambda _: 0.0, _airy, 0.04532),
}  # fmt: skip
