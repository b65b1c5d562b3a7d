# SPDX-License-Identifier: MIT OR Apache-2.0
"""Chunks of bags and MCAP files, decompressed to no more than what they announce.

A few kilobytes can decompress to gigabytes, so the libraries are asked for a bounded part only.
"""

from __future__ import annotations

import bz2
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable

MOST_OF_CHUNK = 2**27  # bytes; recorders write chunks of some megabytes


def require_chunk(size: int) -> None:
    """Refuse a chunk that announces more than any recorder writes.

    Raises
    ------
    ValueError
    """
    if size > MOST_OF_CHUNK:
        msg = f"a chunk of {size} bytes; the most is {MOST_OF_CHUNK}"
        raise ValueError(msg)


def decompressed(compression: str, data: bytes, size: int = MOST_OF_CHUNK) -> bytes:
    """Return the bytes of a chunk.

    Parameters
    ----------
    compression : as the container names it
    size : bytes at most

    Raises
    ------
    ValueError, KeyError, or an error of the decompressor
        It has more bytes, is damaged, or of another kind.
    """
    require_chunk(max(size, len(data)))
    if compression in {"", "none"}:
        return data
    decompressor = _DECOMPRESSORS[compression]()
    # One byte more than there may be tells a chunk that is too large from one that fits.
    found: bytes = decompressor.decompress(data, size + 1)
    if len(found) > size:
        msg = f"a chunk of more than the {size} bytes that it may have"
        raise ValueError(msg)
    if not decompressor.eof:
        msg = "the compressed data end too early"
        raise ValueError(msg)
    return found


def _lz4() -> Any:  # noqa: ANN401 - untyped
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]

    return LZ4FrameDecompressor()


def _zstd() -> Any:  # noqa: ANN401 - one of two modules
    if sys.version_info >= (3, 14):
        from compression import zstd
    else:
        from backports import zstd
    return zstd.ZstdDecompressor()


_DECOMPRESSORS: dict[str, Callable[[], Any]] = {
    "bz2": bz2.BZ2Decompressor,
    "lz4": _lz4,
    "zstd": _zstd,
}


def bound_rosbags() -> None:
    """Let rosbags decompress the chunks of MCAP files by `decompressed`: it sets no bounds itself."""
    from rosbags.rosbag2 import storage_mcap  # slow to import, and no ROS 1 bag needs it

    def bounded(compression: str) -> Callable[[bytes, int], bytes]:
        return lambda data, size: decompressed(compression, data, size)

    storage_mcap.DECOMPRESSORS.update({name: bounded(name) for name in ("", "lz4", "zstd")})
