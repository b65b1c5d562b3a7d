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
from bentwing.recording.scan_times import ScanReading, find_scan_turn

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from bentwing.recording.point_times import GivenTimes
    from bentwing.recording.sweep_stamps import SweepStamps

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
        given: GivenTimes,
    ) -> tuple[str | None, ScanReading | None]:
        """Return the sentence on the first scan that can be read."""
        given.refuse("are scans, which have no time field", "time_field", "time_unit")
        if given.reference == "absolute":
            given.refuse("are scans, whose beams count from the stamp", "time_reference")
        scan = self._first(messages)
        if scan is None or not has_beam_times(scan):
            return None, None
        said = f"time per beam: stamp + i * {scan.time_increment * 1e6:.4g} us"
        if given.reference is None or given.reference == "start":
            return said, None
        reading = ScanReading.of(scan, given.reference)
        return f"{said}, from {1e3 * reading.first:.2f} ms on", reading

    def made_times(self, messages: Sequence[bytes], stamps: SweepStamps) -> ScanReading | str:
        """Return how beams get times where the scans have none, or why they cannot."""
        scan = self._first(messages)
        return "no scan can be read" if scan is None else find_scan_turn(scan, stamps)

    @property
    def _times(self) -> ScanReading | None:
        return self.reading if isinstance(self.reading, ScanReading) else None

    def _first(self, messages: Sequence[bytes]) -> RawScan | None:
        """Return the first scan with beams, else any that can be read."""
        found = None
        for raw in messages:
            try:
                scan = self.parse(raw, Counter())
            except wire.BrokenMessageError:
                continue
            if len(scan.ranges) > 1:
                return scan
            found = found or scan
        return found

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
        makes_them = self._times is not None and self._times.turn is not None
        return makes_them or has_beam_times(message)

    def batches(
        self, messages: Sequence[RawScan], starts: NDArray[np.float64], counts: Counter[str]
    ) -> list[LidarBatch]:
        """Return the points in the scan plane."""
        return points_of_scans(messages, starts, counts, self.range_scale, self._times)


class MultiEchoScans(LaserScans):
    """sensor_msgs/MultiEchoLaserScan."""

    _read: ClassVar[Callable[..., RawScan]] = staticmethod(wire_scans.multi_echo_scan)


def has_beam_times(scan: RawScan) -> bool:
    """Whether a scan tells the time of each beam: `stamp + i * time_increment`."""
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
    reading: ScanReading | None = None,
) -> list[LidarBatch]:
    """Return the valid returns of consecutive scans, one batch per run of equal geometry.

    Parameters
    ----------
    scans : all `is_sane`
    starts : (S,) s, time of each scan's first beam
    counts : receives `returns` (all beams), `nan`, `inf`, `zero`, `out_of_range`
    range_scale : m per unit of the ranges
    reading : of the beams' times, where the scans do not tell them all
    """
    batches = []
    pairs = zip(scans, starts.tolist(), strict=True)
    for _, run in itertools.groupby(pairs, key=lambda pair: _geometry(pair[0])):
        members, times = zip(*run, strict=True)
        batches.append(_points_of_run(members, np.array(times), counts, range_scale, reading))
    return batches


def _geometry(scan: RawScan) -> tuple[float | int | bool, ...]:
    return (*scan[1:4], *scan[5:7], len(scan.ranges), scan.intensities is None)


def _points_of_run(
    scans: Sequence[RawScan],
    starts: NDArray[np.float64],
    counts: Counter[str],
    range_scale: float,
    reading: ScanReading | None,
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
    increment = head.time_increment
    if reading is not None:
        increment, starts = reading.increment(head), starts + reading.start(head)
    times = starts[:, None] + np.arange(shape[1]) * increment
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
