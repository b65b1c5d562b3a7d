# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is free goes back to the system, where the C library can."""

from __future__ import annotations

import ctypes
import os
import platform
from pathlib import Path

import pytest

from bentwing.base.memory import give_back

pytestmark = pytest.mark.skipif(
    platform.libc_ver()[0] != "glibc", reason="other C libraries give back by themselves, or never"
)

BLOCK, N = 60_000, 2_000  # bytes: too few for pages of their own


def resident() -> int:
    """Bytes of the process that are in memory."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_blocks_below_one_that_is_in_use_go_back_to_the_system():
    blocks = [bytearray(b"\x01") * BLOCK for _ in range(N)]
    held = resident()
    in_use = blocks[-1]
    blocks.clear()
    give_back()
    assert resident() < held - N * BLOCK / 2
    assert len(in_use) == BLOCK


def test_a_c_library_that_cannot_give_back_is_no_error(monkeypatch: pytest.MonkeyPatch):
    asked = []

    def lacking(name: None) -> object:
        asked.append(name)
        return object()

    monkeypatch.setattr(ctypes, "CDLL", lacking)
    give_back()
    assert asked == [None]
