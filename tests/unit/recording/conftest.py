# SPDX-License-Identifier: MIT OR Apache-2.0
"""Raw packets of known walls, and captures of them."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from support.captures import (
    VLP16_ELEVATIONS_DEG,
    ethernet,
    udp,
    vlp16_packet,
    vlp16_turns,
    wall,
    write_datagrams,
    write_pcap,
)


@pytest.fixture(scope="session")
def packets():
    """Makers of packets and captures."""
    return SimpleNamespace(
        vlp16=vlp16_packet, vlp16_turns=vlp16_turns, wall=wall, udp=udp, ethernet=ethernet,
        write_pcap=write_pcap, write_datagrams=write_datagrams,
        elevations_deg=VLP16_ELEVATIONS_DEG,
    )  # fmt: skip
