# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scans of a 2D lidar → points in its scan plane (z = 0) with a time per beam."""

from __future__ import annotations

import functools
import itertools
import math
from collections import Counter
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from bentwing.recording.batches import LidarBatch
from bentwing.recording.messages import wire, wire_scans
from bentwing.recording.messages.decoder import LidarDecoder
from bentwing.recording.messages.wire_scans import RawScan

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

REACH = 30.0  # m, of a usual 2D lidar
MAX_SWEEP = 10.0  # s; a longer scan is a damaged time_increment


class LaserScans(LidarDecoder[RawScan]):
    """sensor_msgs/LaserScan."""

    is_planar: ClassVar[bool] = True
    _read: ClassVar[Callable[..., RawScan]] = staticmethod(wire_scans.laser_scan)

    def point_times(
        self,
        messages: Sequence[bytes],
        stamps_ns: Sequence[int],  # noqa: ARG002 - clouds need them
    ) -> tuple[str | None, None]:
        """Return the sentence on the first scan that can be read."""
        for raw in messages:
            try:
                scan = self.parse(raw, Counter())
            except wire.BrokenMessageError:
                continue
            if not has_beam_times(scan):
                return None, None
            return f"time per beam: stamp + i * {scan.time_increment * 1e6:.4g} us", None
        return None, None

    def parse(self, raw: bytes, counts: Counter[str]) -> RawScan:
        """Read a message; one without beams has no geometry that could be wrong."""
        scan = self._read(raw, cdr=self.cdr)
        if not len(scan.ranges):
            counts["empty_scans"] += 1
            return scan._replace(angle_min=0.0, angle_increment=0.0, time_increment=0.0)
        if not is_sane(scan):
            msg = "angles or times that cannot be computed with"
            raise wire.BrokenMessageError(msg)
        return scan

    def has_point_times(self, message: RawScan) -> bool:
        """Whether the time of each beam is known."""
        return has_beam_times(message)

    def batches(
        self, messages: Sequence[RawScan], starts: NDArray[np.float64], counts: Counter[str]
    ) -> list[LidarBatch]:
        """Return the points in the scan plane."""
        return points_of_scans(messages, starts, counts, self.range_scale)


class MultiEchoScans(LaserScans):
    """sensor_msgs/MultiEchoLaserScan."""

    _read: ClassVar[Callable[..., RawScan]] = staticmethod(wire_scans.multi_echo_scan)


def has_beam_times(scan: RawScan) -> bool:
    """Whether the time of each beam is known: `stamp + i * time_increment`."""
    return scan.time_increment != 0.0 or len(scan.ranges) < 2


def is_sane(scan: RawScan) -> bool:
    """Whether angles and times can be computed with; damaged messages fail here."""
    numbers = (scan.angle_min, scan.angle_increment, scan.time_increment)
    duration = abs(scan.time_increment) * len(scan.ranges)
    return all(map(math.isfinite, numbers)) and duration < MAX_SWEEP


def points_of_scans(
    scans: Sequence[RawScan],
    starts: NDArray[np.float64],
    counts: Counter[str],
    range_scale: float = 1.0,
) -> list[LidarBatch]:
    """Return the valid returns of consecutive scans, one batch per run of equal geometry.

    Parameters
    ----------
    scans : all `is_sane`
    starts : (S,) s, time of each scan's first beam
    counts : receives `returns` (all beams), `nan`, `inf`, `zero`, `out_of_range`
    range_scale : m per unit of the ranges
    """
    batches = []
    pairs = zip(scans, starts.tolist(), strict=True)
    for _, run in itertools.groupby(pairs, key=lambda pair: _geometry(pair[0])):
        members, times = zip(*run, strict=True)
        batches.append(_points_of_run(members, np.array(times), counts, range_scale))
    return batches


def _geometry(scan: RawScan) -> tuple[float | int | bool, ...]:
    return (*scan[1:4], *scan[5:7], len(scan.ranges), scan.intensities is None)


def _points_of_run(
    scans: Sequence[RawScan],
    starts: NDArray[np.float64],
    counts: Counter[str],
    range_scale: float,
) -> LidarBatch:
    head = scans[0]
    shape = len(scans), len(head.ranges)
    ranges = _joined([scan.ranges for scan in scans]).reshape(shape)
    low, high = _limits(head, range_scale)
    keep = _valid(ranges, low, high, counts)
    # All beams are placed and the valid ones taken: that is cheaper than to find each one's angle.
    distances = np.where(keep, ranges, 0).astype(np.float64)
    cosines, sines = _directions(head.angle_min, head.angle_increment, shape[1])
    points = np.zeros((*shape, 3))
    np.multiply(cosines, distances, out=points[..., 0])
    np.multiply(sines, distances, out=points[..., 1])
    times = starts[:, None] + np.arange(shape[1]) * head.time_increment
    intensity = None
    if head.intensities is not None:
        intensity = _joined([s.intensities for s in scans if s.intensities is not None])
    return LidarBatch(points.reshape(-1, 3), times.ravel(), intensity).where(keep.ravel())


def _limits(head: RawScan, range_scale: float) -> tuple[float, float]:
    """Return the least and greatest range in the unit of the ranges.

    A driver that gives ranges in millimetres may give its limits in either unit: they are in the one in
    which the lidar's reach is nearer to that of lidars.
    """
    low, high = head.range_min, head.range_max
    if range_scale == 1.0 or not high > 0:
        return low, high
    is_scaled, is_metric = (abs(math.log(reach / REACH)) for reach in (high * range_scale, high))
    return (low, high) if is_scaled <= is_metric else (low / range_scale, high / range_scale)


def _valid(
    ranges: NDArray[np.float32], low: float, high: float, counts: Counter[str]
) -> NDArray[np.bool_]:
    """Return which ranges are returns, and count why the others are not."""
    # Some drivers leave the limits at zero; NaN limits compare false and keep nothing.
    within = (ranges >= low) & (ranges <= high) if high > 0 else ranges > 0
    keep = within & (ranges != 0) & np.isfinite(ranges)
    masks = {"nan": np.isnan(ranges), "inf": np.isinf(ranges), "zero": ranges == 0}
    unusable = {reason: int(np.count_nonzero(mask)) for reason, mask in masks.items()}
    n_far = ranges.size - int(np.count_nonzero(keep)) - sum(unusable.values())
    counts.update({"returns": ranges.size, **unusable, "out_of_range": n_far})
    return np.asarray(keep, dtype=np.bool_)


def _joined(parts: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    return np.concatenate(parts).astype(np.float32, copy=False)


@functools.lru_cache(maxsize=8)
def _directions(
    angle_min: float, increment: float, n: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Cosines and sines (n,) of the beams' angles in the scan plane."""
    angles = angle_min + np.arange(n) * increment
    return np.cos(angles), np.sin(angles)
