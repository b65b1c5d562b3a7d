# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clouds of a 3D lidar, of any field layout → points with a time each."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from bentwing.recording import point_times
from bentwing.recording.attributes import NO_ATTRIBUTES, selectable
from bentwing.recording.batches import LidarBatch, rows
from bentwing.recording.messages import wire_clouds
from bentwing.recording.messages.decoder import LidarDecoder
from bentwing.recording.messages.wire import BrokenMessageError
from bentwing.recording.point_times import TimeReading
from bentwing.recording.turn_finding import Sweep, find_turn
from bentwing.recording.turn_times import TurnReading

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes
    from bentwing.recording.messages.wire_clouds import RawCloud, RawField
    from bentwing.recording.point_times import GivenTimes, Reading
    from bentwing.recording.sweep_stamps import SweepStamps

DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
INTENSITY_NAMES = ("intensity", "intensities", "reflectivity", "signal")
RING_NAMES = ("ring", "channel", "line")


class Columns(NamedTuple):
    """Valid points of a cloud in the order of the message.

    `raw_times` as the sensor gives them; `line` of an organized cloud that has no rings.
    """

    points: NDArray[np.float64]
    raw_times: NDArray[np.generic] | None
    intensity: NDArray[np.float32] | None
    ring: NDArray[np.uint16] | None
    line: NDArray[np.uint16] | None = None
    attributes: NDArray[np.void] | None = None


class Cloud(NamedTuple):
    """Valid points of a message."""

    stamp_ns: int
    columns: Columns


class PointClouds(LidarDecoder[Cloud]):
    """sensor_msgs/PointCloud2; without a reading all points have the header stamp."""

    def point_times(
        self, messages: Sequence[bytes], stamps_ns: Sequence[int], given: GivenTimes
    ) -> tuple[str | None, TimeReading | None]:
        """Decide on the last readable cloud; the first ones of a driver are often incomplete."""
        steps = np.diff(np.array(stamps_ns, dtype=np.int64))
        period = float(np.median(steps)) * 1e-9 if len(steps) and np.median(steps) > 0 else None
        for raw in reversed(messages):
            try:
                cloud = wire_clouds.point_cloud(raw, cdr=self.cdr)
                raw_times = columns(cloud, Counter(), given.field).raw_times
            except BrokenMessageError:
                continue
            name = time_field(cloud, given.field)
            if name is None or raw_times is None:
                given.refuse(_without(cloud), "time_field", "time_unit")
                continue
            reading = point_times.decide(name, raw_times, cloud.stamp_ns, period, given)
            if reading is not None:
                return str(reading), reading
        given.refuse("have none that varies as the times of a sweep do", "time_field", "time_unit")
        return None, None

    def made_times(self, messages: Sequence[bytes], stamps: SweepStamps) -> TurnReading | str:
        """Return how points get times by the turn of the lidar, or why they cannot."""
        sweeps = []
        for raw in messages:
            try:
                found = self.parse(raw, Counter()).columns
            except BrokenMessageError:
                continue
            sweeps.append(Sweep(found.points, found.line if found.ring is None else found.ring))
        return find_turn(sweeps, stamps)

    def stamp_and_span(self, raw: bytes) -> tuple[int, float | None]:
        """Return the stamp of a message, ns, and the time from its first to its last point, s."""
        cloud = wire_clouds.point_cloud(raw, cdr=self.cdr)
        if not isinstance(self.reading, TimeReading):
            return cloud.stamp_ns, None
        name = time_field(cloud, self.reading.name)
        if name is None:
            return cloud.stamp_ns, None
        offsets = self.reading.offsets(_native(_table(cloud).reshape(-1)[name]), cloud.stamp_ns)
        known = offsets[np.isfinite(offsets)]
        return cloud.stamp_ns, float(np.ptp(known)) if len(known) else None

    def fields(self, raw: bytes) -> dict[str, np.dtype[Any]]:
        """Return the fields beside the coordinates."""
        found = _usable_fields(wire_clouds.point_cloud(raw, cdr=self.cdr))
        return selectable({n: DATATYPES[f.datatype] for n, f in found.items() if n not in {*"xyz"}})

    def parse(self, raw: bytes, counts: Counter[str]) -> Cloud:
        """Read a message."""
        cloud = wire_clouds.point_cloud(raw, cdr=self.cdr)
        name = self.reading.name if isinstance(self.reading, TimeReading) else None
        return Cloud(cloud.stamp_ns, columns(cloud, counts, name, self.attributes))

    def batches(
        self, messages: Sequence[Cloud], starts: NDArray[np.float64], counts: Counter[str]
    ) -> list[LidarBatch]:
        """Return the points, sorted by time, one batch per message."""
        # Absolute point times are relative to the header's own stamp, zero or not.
        return [
            sweep(cloud.columns, self.reading, cloud.stamp_ns, start, counts)
            for cloud, start in zip(messages, starts.tolist(), strict=True)
        ]


def time_field(cloud: RawCloud, name: str | None = None) -> str | None:
    """Return the name of the field that holds the points' times, if there is one: `name`, or a usual one."""
    return _find(_usable_fields(cloud), point_times.NAMES if name is None else (name.lower(),))


def _without(cloud: RawCloud) -> str:
    return f"have the fields {', '.join(_usable_fields(cloud)) or 'none'}"


def columns(
    cloud: RawCloud,
    counts: Counter[str],
    times: str | None = None,
    attributes: Attributes = NO_ATTRIBUTES,
) -> Columns:
    """Return the valid points of a cloud.

    Parameters
    ----------
    cloud : the message
    counts : receives `returns` (all points), `nan`, `inf`, `zero`
    times : name of the time field; None: a usual one
    attributes : further fields that are wanted

    Raises
    ------
    BrokenMessageError
        The layout contradicts itself, or x, y, z or an attribute are missing.
    """
    table = _table(cloud).reshape(-1)
    names = table.dtype.names or ()
    needed = (*"xyz", *attributes.sources)
    if not set(needed) <= set(names):
        found = ", ".join(field.name for field in cloud.fields) or "none"
        msg = f"no fields {', '.join(needed)} (found {found})"
        raise BrokenMessageError(msg)
    points = np.empty((len(table), 3))
    for axis, name in enumerate("xyz"):
        points[:, axis] = table[name]
    keep = valid(points, counts)
    if not keep.all():
        chosen = np.flatnonzero(keep)
        points, table = rows(points, chosen), rows(table, chosen)
    intensity, ring = (_find(names, group) for group in (INTENSITY_NAMES, RING_NAMES))
    time = time_field(cloud, times)
    return Columns(
        points,
        None if time is None else _native(table[time]),
        None if intensity is None else table[intensity].astype(np.float32),
        None if ring is None else _rings(table[ring]),
        _lines(cloud)[keep] if ring is None and cloud.height > 1 else None,
        attributes.gathered(len(table), table.__getitem__),
    )


def _lines(cloud: RawCloud) -> NDArray[np.uint16]:
    """Return the line of each point of an organized cloud: its beam, of which there are fewer."""
    lines = np.indices((cloud.height, cloud.width), dtype=np.uint16)
    return np.ravel(lines[0 if cloud.height <= cloud.width else 1])


def sweep(
    cols: Columns,
    reading: Reading | None,
    stamp_ns: int,
    start: float,
    counts: Counter[str],
) -> LidarBatch:
    """Return the points with times, sorted.

    Parameters
    ----------
    cols : valid points
    reading : how to read the time field, or to make times; None puts every point at the header stamp
    stamp_ns, start : header stamp, in ns and in s since the recording's start
    counts : receives `bad_point_time`, points more than a second from their header
    """
    if isinstance(reading, TurnReading):
        groups = cols.line if cols.ring is None else cols.ring
        offsets = reading.offsets(cols.points, groups)
        batch = _batch(cols, start + offsets)
        return batch.where(np.argsort(offsets, kind="stable"))
    if not isinstance(reading, TimeReading) or cols.raw_times is None:
        times = np.full(len(cols.points), start)
        return _batch(cols, times)
    offsets = reading.offsets(cols.raw_times, stamp_ns)
    limit = (
        point_times.MAX_CLOCK_DIFFERENCE if reading.origin == "epoch" else point_times.MAX_OFFSET
    )
    keep = np.abs(offsets) <= limit
    batch = _batch(cols, start + offsets)
    if not keep.all():
        counts["bad_point_time"] += int((~keep).sum())
        batch = batch.where(keep)
    if (batch.times[1:] < batch.times[:-1]).any():
        batch = batch.where(np.argsort(batch.times, kind="stable"))
    return batch


def _batch(cols: Columns, times: NDArray[np.float64]) -> LidarBatch:
    return LidarBatch(cols.points, times, cols.intensity, cols.ring, attributes=cols.attributes)


def _table(cloud: RawCloud) -> NDArray[np.void]:
    """(height, width) structured view on the message's bytes, no copy."""
    fields = _usable_fields(cloud)
    if not fields or cloud.point_step == 0:
        msg = f"{len(cloud.fields)} fields in points of {cloud.point_step} bytes"
        raise BrokenMessageError(msg)
    n_row = cloud.width * cloud.point_step
    # Some drivers leave row_step at zero in clouds of one row.
    row_step = cloud.row_step if cloud.height > 1 else n_row
    needed = (cloud.height - 1) * row_step + n_row if cloud.height * cloud.width else 0
    if row_step < n_row or needed > len(cloud.data):
        msg = (
            f"{cloud.height} x {cloud.width} points of {cloud.point_step} bytes and rows of "
            f"{cloud.row_step} bytes do not fit into {len(cloud.data)} bytes"
        )
        raise BrokenMessageError(msg)
    order = ">" if cloud.big_endian else "<"
    dtype = np.dtype(
        {
            "names": list(fields),
            "formats": [order + DATATYPES[field.datatype] for field in fields.values()],
            "offsets": [field.offset for field in fields.values()],
            "itemsize": cloud.point_step,
        }
    )
    shape = (cloud.height, cloud.width) if needed else (0, 0)
    return np.ndarray(shape, dtype, cloud.data, strides=(row_step, cloud.point_step))


def _usable_fields(cloud: RawCloud) -> dict[str, RawField]:
    """Return the named scalar fields that lie within a point, the first of each name."""
    fields: dict[str, RawField] = {}
    for field in cloud.fields:
        size = np.dtype(DATATYPES[field.datatype]).itemsize if field.datatype in DATATYPES else 0
        # A number of zero is what some drivers write for a scalar.
        if size and field.name and field.n_values <= 1 and field.offset + size <= cloud.point_step:
            fields.setdefault(field.name, field)
    return fields


def valid(points: NDArray[np.float64], counts: Counter[str]) -> NDArray[np.bool_]:
    """Return which points are returns; `is_dense` is not trusted, many drivers set it wrongly."""
    counts["returns"] += len(points)
    x, y, z = points.T
    # Columns one by one: a reduction over rows of three takes several times longer.
    is_finite = np.isfinite(x) & np.isfinite(y) & np.isfinite(z)
    is_zero = (x == 0) & (y == 0) & (z == 0)
    keep = is_finite & ~is_zero
    if not keep.all():
        is_nan = np.isnan(x) | np.isnan(y) | np.isnan(z)
        counts["nan"] += int(is_nan.sum())
        counts["inf"] += int((~is_finite & ~is_nan).sum())
        counts["zero"] += int(is_zero.sum())
    return np.asarray(keep, dtype=np.bool_)


def _find(names: dict[str, RawField] | tuple[str, ...], wanted: tuple[str, ...]) -> str | None:
    by_lower = {name.lower(): name for name in names}
    return next((by_lower[name] for name in wanted if name in by_lower), None)


def _native(values: NDArray[np.generic]) -> NDArray[np.generic]:
    return np.ascontiguousarray(values.astype(values.dtype.newbyteorder("=")))


def _rings(values: NDArray[np.generic]) -> NDArray[np.uint16] | None:
    """Return beam numbers; a ring field that holds anything else is not used."""
    if values.dtype.kind == "u" and values.dtype.itemsize <= 2:
        return values.astype(np.uint16)
    numbers = values.astype(np.float64)
    if np.all((numbers >= 0) & (numbers < 65536)):
        return numbers.astype(np.uint16)
    return None
