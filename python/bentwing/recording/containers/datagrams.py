# SPDX-License-Identifier: MIT OR Apache-2.0
"""Take the UDP datagrams out of captured network frames, whole again where IP had split them.

Ouster's packets are larger than an Ethernet frame, so each of them arrives in several fragments.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

IP_V4, UDP = 0x0800, 17
VLAN_TAGS = (0x8100, 0x88A8, 0x9100)
# Where the protocol of the payload stands and where the payload begins, by the link type of the
# capture; no protocol where only IP can follow (https://www.tcpdump.org/linktypes.html).
LINKS: dict[int, tuple[int | None, int]] = {
    0: (None, 4),  # BSD loopback
    1: (12, 14),  # Ethernet
    12: (None, 0),  # raw IP
    101: (None, 0),
    108: (None, 4),
    113: (14, 16),  # Linux "any" device
    228: (None, 0),
    276: (0, 20),
}
MAX_PENDING = 64  # datagrams of which fragments are missing; the oldest is given up


class Datagram(NamedTuple):
    """UDP payload with where it came from and where it went."""

    source: str
    port: int
    payload: bytes


class FrameProblemError(ValueError):
    """A frame that is no part of a UDP datagram; the text is its kind."""


class DatagramReader:
    """Frames of one capture, in their order."""

    def __init__(self, link: int) -> None:
        self._protocol_at, self._begin = LINKS[link]
        self._pending: dict[bytes, dict[int, bytes]] = {}
        self._totals: dict[bytes, int] = {}
        self.n_incomplete = 0

    def push(self, frame: bytes) -> Datagram | None:
        """Take the next frame; return the datagram it completes.

        Raises
        ------
        FrameProblemError
            It is none of UDP over IPv4.
        """
        begin = self._ip_begin(frame)
        if len(frame) < begin + 20 or frame[begin] >> 4 != 4 or frame[begin + 9] != UDP:
            raise FrameProblemError("not UDP")
        head = 4 * (frame[begin] & 15)
        size, _, fragment = struct.unpack_from(">HHH", frame, begin + 2)
        # Frames are padded to 64 bytes; a size of zero is what network cards that split leave.
        body = frame[begin + head : begin + size if size else len(frame)]
        if size and len(body) != size - head:
            self.n_incomplete += 1
            return None
        whole = body if fragment & 0x3FFF == 0 else self._joined(frame, begin, fragment, body)
        return None if whole is None else self._datagram(frame, begin, whole)

    def _ip_begin(self, frame: bytes) -> int:
        if self._protocol_at is None:
            return self._begin
        at, begin = self._protocol_at, self._begin
        protocol = int.from_bytes(frame[at : at + 2], "big")
        while protocol in VLAN_TAGS:
            protocol = int.from_bytes(frame[begin + 2 : begin + 4], "big")
            begin += 4
        if protocol != IP_V4:
            raise FrameProblemError("not UDP")
        return begin

    def _joined(self, frame: bytes, begin: int, fragment: int, body: bytes) -> bytes | None:
        """Keep a fragment; return the datagram's bytes when none is missing."""
        key = frame[begin + 4 : begin + 6] + frame[begin + 12 : begin + 20]
        parts = self._pending.setdefault(key, {})
        offset = 8 * (fragment & 0x1FFF)
        parts[offset] = body
        if not fragment & 0x2000:
            self._totals[key] = offset + len(body)
        if sum(map(len, parts.values())) == self._totals.get(key):
            self._forget(key)
            return b"".join(parts[offset] for offset in sorted(parts))
        if len(self._pending) > MAX_PENDING:
            self._forget(next(iter(self._pending)))
            self.n_incomplete += 1
        return None

    def _forget(self, key: bytes) -> None:
        del self._pending[key]
        self._totals.pop(key, None)

    def _datagram(self, frame: bytes, begin: int, body: bytes) -> Datagram | None:
        if len(body) < 8:
            self.n_incomplete += 1
            return None
        port, size = struct.unpack_from(">HH", body, 2)
        if size and size > len(body):
            self.n_incomplete += 1
            return None
        source = ".".join(map(str, frame[begin + 12 : begin + 16]))
        return Datagram(source, port, body[8 : size or len(body)])
