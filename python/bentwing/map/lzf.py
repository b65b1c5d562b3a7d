# SPDX-License-Identifier: MIT OR Apache-2.0
"""The compression of PCD files: Marc Lehmann's LZF."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

_LITERAL = 32  # controls below it announce so many bytes, and one more, as they are
_LONG = 7
_REACH = 1 << 13  # bytes back that a repetition may begin
_BLOCK = 1 << 20


def decompress_lzf(data: bytes | memoryview, size: int) -> Iterator[bytes]:
    """Yield exactly `size` decompressed bytes, in blocks: what is announced need not be true.

    Raises
    ------
    ValueError, IndexError
        If the data are damaged or of another length.
    """
    out, done = bytearray(), 0
    at, end = 0, len(data)
    while at < end:
        control = data[at]
        at += 1
        if control < _LITERAL:
            out += data[at : at + control + 1]
            at += control + 1
        else:
            length, at = _length(data, at, control >> 5)
            first = len(out) - ((control & 31) << 8) - data[at] - 1
            at += 1
            if first < 0:
                break
            # what is repeated may overlap what it becomes
            period = out[first : first + length]
            out += (period * (length // len(period) + 1))[:length]
        if done + len(out) > size:
            break
        if len(out) > _BLOCK + _REACH:
            yield bytes(out[:-_REACH])
            done += len(out) - _REACH
            del out[:-_REACH]
    if at != end or done + len(out) != size:
        msg = f"the compressed data are damaged: {done + len(out)} bytes instead of {size}"
        raise ValueError(msg)
    yield bytes(out)


def _length(data: bytes | memoryview, at: int, short: int) -> tuple[int, int]:
    """Length of a repetition, and where its distance goes on."""
    if short == _LONG:
        return short + data[at] + 2, at + 1
    return short + 2, at
