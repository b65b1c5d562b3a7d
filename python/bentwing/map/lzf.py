# SPDX-License-Identifier: MIT OR Apache-2.0
"""The compression of PCD files: Marc Lehmann's LZF."""

from __future__ import annotations

_LITERAL = 32  # controls below it announce so many bytes, and one more, as they are
_LONG = 7


def decompress_lzf(data: bytes, size: int) -> bytes:
    """Decompress to exactly `size` bytes.

    Raises
    ------
    ValueError
        If the data are damaged or of another length.
    """
    out = bytearray()
    at, end = 0, len(data)
    while at < end:
        control = data[at]
        at += 1
        if control < _LITERAL:
            out += data[at : at + control + 1]
            at += control + 1
            continue
        length, at = _length(data, at, control >> 5)
        first = len(out) - ((control & 31) << 8) - data[at] - 1
        at += 1
        if first < 0 or len(out) + length > size:
            break
        # what is repeated may overlap what it becomes
        period = out[first : first + length]
        out += (period * (length // len(period) + 1))[:length]
    if at != end or len(out) != size:
        msg = f"the compressed data are damaged: {len(out)} bytes instead of {size}"
        raise ValueError(msg)
    return bytes(out)


def _length(data: bytes, at: int, short: int) -> tuple[int, int]:
    """Length of a repetition, and where its distance goes on."""
    if short == _LONG:
        return short + data[at] + 2, at + 1
    return short + 2, at
