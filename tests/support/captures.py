# SPDX-License-Identifier: MIT OR Apache-2.0
"""Raw packets of a VLP-16 before walls, and captures of any packets."""

from __future__ import annotations

import struct

import numpy as np

VLP16_ELEVATIONS_DEG = (-15, 1, -13, 3, -11, 5, -9, 7, -7, 9, -5, 11, -3, 13, -1, 15)
BLOCK_US, FIRING_US, LASER_US = 110.592, 55.296, 2.304
UNITS_PER_US = 0.36  # hundredths of a degree at ten turns per second


def vlp16_packet(stamp_us, azimuth, ranges, *, number=0x22, returns=0x37):
    """One packet of twelve blocks.

    stamp_us : of the first firing since the top of the hour
    azimuth : of the first firing, hundredths of a degree
    ranges : (azimuths in rad clockwise from ahead, elevations in rad) → ranges in m, or two of
        them (last, strongest) for packets with dual returns
    """
    is_dual = returns == 0x39
    packet = b""
    for block in range(12):
        step = block // 2 if is_dual else block
        begin = azimuth + step * BLOCK_US * UNITS_PER_US
        lasers = np.arange(32)
        dt = (lasers // 16) * FIRING_US + (lasers % 16) * LASER_US
        angles = np.radians((begin + dt * UNITS_PER_US) / 100)
        found = ranges(angles, np.radians(np.array(VLP16_ELEVATIONS_DEG)[lasers % 16]))
        distances = found[block % 2] if is_dual else found
        values = np.zeros(32, [("distance", "<u2"), ("intensity", "u1")])
        values["distance"] = np.rint(distances / 0.002)
        values["intensity"] = 40 + lasers % 16
        packet += b"\xff\xee" + struct.pack("<H", round(begin) % 36000) + values.tobytes()
    return packet + struct.pack("<IBB", stamp_us % 3_600_000_000, returns, number)


def vlp16_time(packet_index):
    """µs of a packet's first firing since that of packet 0, a whole number as in the packets."""
    return round(packet_index * 12 * BLOCK_US)


def wall(angles, elevations):
    """Ranges to the wall x = 4 m, and nothing beyond 60° to the sides."""
    with np.errstate(divide="ignore"):
        ranges = 4.0 / (np.cos(angles) * np.cos(elevations))
    return np.where(np.cos(angles) > 0.5, ranges, 0.0)


def vlp16_turns(duration, *, first_us=0, ranges=wall, every=1, **values):
    """(µs since the first packet, packet) of a turning VLP-16, or only `every` so many of them."""
    times = [vlp16_time(i) for i in range(0, int(duration * 1e6 / (12 * BLOCK_US)), every)]
    return [
        (t, vlp16_packet(first_us + t, t * UNITS_PER_US % 36000, ranges, **values)) for t in times
    ]


def udp(payload, *, source="192.168.1.201", port=2368, mtu=1500, identity=0):
    """IPv4 packets of a datagram, in fragments where it is larger than the MTU."""
    datagram = struct.pack(">HHHH", port, port, 8 + len(payload), 0) + payload
    step = (mtu - 20) // 8 * 8
    packets = []
    for begin in range(0, len(datagram), step):
        part = datagram[begin : begin + step]
        more = 0x2000 if begin + step < len(datagram) else 0
        head = struct.pack(
            ">BBHHHBBH", 0x45, 0, 20 + len(part), identity, more | begin // 8, 64, 17, 0
        )
        packets.append(head + bytes(map(int, source.split("."))) + bytes(4) + part)
    return packets


def ethernet(packet, *, vlan=False, protocol=0x0800):
    tag = struct.pack(">HH", 0x8100, 7) if vlan else b""
    return bytes(12) + tag + struct.pack(">H", protocol) + packet


def write_pcap(path, frames, *, magic=0xA1B2C3D4, order="<", link=1):
    """Write (stamp in ns, frame) to a capture."""
    unit_ns = 1 if magic == 0xA1B23C4D else 1000
    parts = [struct.pack(f"{order}IHHiIII", magic, 2, 4, 0, 0, 65535, link)]
    for stamp_ns, frame in frames:
        seconds, rest = divmod(stamp_ns, 10**9)
        size = len(frame)
        parts += [struct.pack(f"{order}IIII", seconds, rest // unit_ns, size, size), frame]
    path.write_bytes(b"".join(parts))
    return path


def write_datagrams(path, datagrams, **values):
    """Write (stamp in ns, payload) of one sender to a capture."""
    frames = [
        (stamp_ns, ethernet(packet))
        for i, (stamp_ns, payload) in enumerate(datagrams)
        for packet in udp(payload, identity=i % 65536, **values)
    ]
    return write_pcap(path, frames)
