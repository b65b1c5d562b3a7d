# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clouds of Livox lidars → points with a time each; arguments and errors of readers as in `wire`."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bentwing.recording.attributes import selectable
from bentwing.recording.batches import LidarBatch
from bentwing.recording.messages.decoder import LidarDecoder
from bentwing.recording.messages.point_cloud2 import valid
from bentwing.recording.messages.wire import align, broken_if_malformed, header

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes
    from bentwing.recording.point_times import GivenTimes

MAX_OFFSET_NS = 1_000_000_000
CUSTOM_MSG = "livox_ros_driver2/msg/CustomMsg"


class RawLivox(NamedTuple):
    """Livox CustomMsg; `points` is structured: offset_time (ns), x, y, z (m), reflectivity, tag, line."""

    stamp_ns: int
    points: NDArray[np.void]


class LivoxClouds(LidarDecoder[RawLivox]):
    """livox_ros_driver(2)/CustomMsg."""

    def point_times(
        self,
        messages: Sequence[bytes],  # noqa: ARG002 - all of them have times
        stamps_ns: Sequence[int],  # noqa: ARG002
        given: GivenTimes,
    ) -> tuple[str, None]:
        """Return the sentence on the offsets."""
        given.refuse("have the field offset_time", "time_field", "time_unit", "time_reference")
        return "time per point from offset_time (uint32): ns, relative to the time base", None

    def stamp_and_span(self, raw: bytes) -> tuple[int, float | None]:
        """Return the stamp of a message, ns, and the time from its first to its last point, s."""
        message = livox_custom(raw, cdr=self.cdr)
        offsets = message.points["offset_time"]
        return message.stamp_ns, float(np.ptp(offsets)) * 1e-9 if len(offsets) else None

    def fields(self, raw: bytes) -> dict[str, np.dtype[Any]]:
        """Return the fields beside the coordinates."""
        dtype = livox_custom(raw, cdr=self.cdr).points.dtype
        return selectable({n: dtype[n] for n in dtype.names or () if n not in {*"xyz"}})

    def parse(self, raw: bytes, counts: Counter[str]) -> RawLivox:  # noqa: ARG002 - nothing is left out yet
        """Read a message."""
        return livox_custom(raw, cdr=self.cdr)

    def batches(
        self, messages: Sequence[RawLivox], starts: NDArray[np.float64], counts: Counter[str]
    ) -> list[LidarBatch]:
        """Return the points, sorted by time, one batch per message."""
        pairs = zip(messages, starts.tolist(), strict=True)
        return [_sweep(message.points, start, counts, self.attributes) for message, start in pairs]


def _sweep(
    table: NDArray[np.void], start: float, counts: Counter[str], attributes: Attributes
) -> LidarBatch:
    points = np.column_stack([table[axis] for axis in "xyz"]).astype(np.float64)
    keep = valid(points, counts)
    is_near = table["offset_time"] < MAX_OFFSET_NS
    counts["bad_point_time"] += int((keep & ~is_near).sum())
    offsets = table["offset_time"].astype(np.float64) * 1e-9
    batch = LidarBatch(
        points,
        start + offsets,
        table["reflectivity"].astype(np.float32),
        table["line"].astype(np.uint16),
        attributes=attributes.gathered(len(table), table.__getitem__),
    ).where(keep & is_near)
    return batch.where(np.argsort(batch.times, kind="stable"))


def custom_message(stamp_ns: int, points: NDArray[np.void]) -> bytes:
    """Return a livox_ros_driver2/CustomMsg in ROS 2's encoding, of points (N,) of the type POINT.

    The offsets count from `stamp_ns`, which is less than 2³¹ s.
    """
    seconds, fraction_ns = divmod(stamp_ns, 1_000_000_000)
    head = b"\0\1\0\0" + struct.pack("<2I", seconds, fraction_ns)
    frame = (
        struct.pack("<I", 12) + b"livox_frame\0"
    )  # leaves the time base on a multiple of eight bytes
    counts = struct.pack("<QI4xI", stamp_ns, len(points), len(points))
    # CDR pads between points, not after the last one.
    return head + frame + counts + points.tobytes()[:-1]


@broken_if_malformed
def livox_custom(raw: bytes, *, cdr: bool) -> RawLivox:
    """Read a livox_ros_driver(2)/CustomMsg."""
    _, position, order = header(raw, cdr=cdr)
    position = align(position, 8, cdr=cdr)
    timebase_ns, n_points = struct.unpack_from(f"{order}QI", raw, position)
    position = align(position + 12 + 4, 4, cdr=cdr)
    (count,) = struct.unpack_from(f"{order}I", raw, position)
    if count != n_points and n_points != 0:
        msg = f"{count} points announced as {n_points}"
        raise ValueError(msg)
    dtype = _livox_dtype(order, 20 if cdr else 19)
    # CDR pads between points, not after the last one.
    body = raw[position + 4 :] + (b"\0" if cdr else b"")
    points = np.frombuffer(body, dtype, count)
    stamp = header(raw, cdr=cdr)[0]
    # The offsets count from the time base, which some drivers leave at zero.
    return RawLivox(timebase_ns if 0 < timebase_ns < 2**63 and stamp else stamp, points)


def _livox_dtype(order: str, step: int) -> np.dtype[np.void]:
    return np.dtype(
        {
            "names": ["offset_time", "x", "y", "z", "reflectivity", "tag", "line"],
            "formats": [f"{order}u4", f"{order}f4", f"{order}f4", f"{order}f4", "u1", "u1", "u1"],
            "offsets": [0, 4, 8, 12, 16, 17, 18],
            "itemsize": step,
        }
    )


POINT = _livox_dtype("<", 20)
