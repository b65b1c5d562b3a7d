# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to the scans and inertial samples that the other engines are given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from benches.peers import attitude, scans
from benches.peers.feed import Feed, Head, Imu, write_feed
from benches.peers.samples import Samples, read
from bentwing.base import geometry
from bentwing.base.transform import apply

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.recording import LidarBatch, Payload

FIRING = {"vlp16": 55.296e-6}
"""s between shots of one beam, so that those without a return leave their place empty."""
EARLY = 1e-6
"""s; a sweep is cut off so much before the next one's stamp, whose first shots rounding may move."""
REACH = 0.2
"""m; so much nearer to the IMU than to the lidar may a point be that has been put into its frame."""


@dataclass(frozen=True, slots=True)
class Cut:
    """Scans before they are written: rows of the points of each, and when it begins and ends, s."""

    kind: str
    rows: list[slice]
    begins: list[float]
    ends: list[float]
    T_body_lidar: np.ndarray
    shape: tuple[int, int]


def prepare(recording: Path, payload: Payload, folder: Path, latency: float = 0.0) -> Feed:
    """Cut a recording into scans and keep them in `folder`.

    Parameters
    ----------
    recording : file
    payload : nominal mounts, as bentwing gets them
    folder : to write into
    latency : s, of the lidar's clock; taken out, since most engines cannot estimate it
    """
    samples = read(recording, payload, latency)
    if payload.encoder is not None:
        return _joined(samples, payload, folder)
    if samples.planar:
        return _stabilized(samples, payload, folder)
    return _sweeps(samples, payload, folder)


def _sweeps(samples: Samples, payload: Payload, folder: Path) -> Feed:
    lidar = samples.lidar
    starts = np.sort(samples.sweeps) - EARLY
    period = float(np.median(np.diff(starts)))
    rows = scans.cut(lidar.times, starts)
    firsts = lidar.times[[part.start for part in rows]]
    begins = (starts[np.searchsorted(starts, firsts, "right") - 1] + EARLY).tolist()
    ends = [begin + period for begin in begins]
    shape, step = _raster(lidar, rows, period, payload.lidar.kind)
    tables = (
        _organised(_packed(lidar, part, begin), shape, step)
        for part, begin in zip(rows, begins, strict=True)
    )
    cut = Cut("sweeps", rows, begins, ends, payload.T_imu_lidar_matrix(), shape)
    imu = _imu(samples, stabilized=False)
    return write_feed(folder, _head(samples, payload, cut), imu, tables)


def _raster(
    lidar: LidarBatch, rows: list[slice], period: float, kind: str
) -> tuple[tuple[int, int], float | None]:
    """Beams and shots of each, and the time between these where it is known of the kind."""
    if lidar.ring is None:
        return (1, max(part.stop - part.start for part in rows)), None
    beams = int(lidar.ring.max()) + 1
    if (step := FIRING.get(kind)) is not None:
        return (beams, int(period / step)), step
    return (beams, max(int(np.bincount(lidar.ring[part]).max()) for part in rows)), None


def _organised(scan: np.ndarray, shape: tuple[int, int], step: float | None) -> np.ndarray:
    if shape[0] == 1:
        return scan
    column = scans.column_by_order(scan) if step is None else scans.column_by_time(scan, step)
    return scans.organised(scan, shape, column)


def _joined(samples: Samples, payload: Payload, folder: Path) -> Feed:
    lidar = samples.lidar
    points = scans.by_encoder(lidar.points, lidar.angles, payload.encoder)
    samples = replace(samples, lidar=replace(lidar, points=points, ring=None))
    rows = scans.cut(lidar.times, scans.grid(lidar.times))
    return _loose("joined", samples, payload, rows, folder)


def _stabilized(samples: Samples, payload: Payload, folder: Path) -> Feed:
    if samples.imu is None:
        msg = "the lines of a 2D lidar cannot be joined into clouds without an IMU"
        raise ValueError(msg)
    times, gyro, accel = samples.imu.times, samples.imu.gyro, samples.imu.accel
    bias = attitude.rest_bias(times, gyro, accel)
    turning = attitude.as_trajectory(times, attitude.integrated(times, gyro, bias))
    lidar = samples.lidar.where(turning.covers(samples.lidar.times))
    _, turns = turning.interpolate(lidar.times)
    points = geometry.rotate(turns, apply(payload.T_imu_lidar_matrix(), lidar.points))
    samples = replace(samples, lidar=replace(lidar, points=points))
    rows = scans.cut(lidar.times, scans.half_turns(times, gyro - bias), scans.LONGEST)
    return _loose("stabilized", samples, payload, rows, folder)


def _loose(kind: str, samples: Samples, payload: Payload, rows: list[slice], folder: Path) -> Feed:
    """Scans of points in the body's frame, without rows and columns."""
    begins = samples.lidar.times[[part.start for part in rows]].tolist()
    ends = samples.lidar.times[[part.stop - 1 for part in rows]].tolist()
    longest = max(part.stop - part.start for part in rows)
    cut = Cut(kind, rows, begins, ends, np.eye(4), (1, longest))
    tables = (_packed(samples.lidar, part, begin) for part, begin in zip(rows, begins, strict=True))
    imu = _imu(samples, stabilized=kind == "stabilized")
    return write_feed(folder, _head(samples, payload, cut), imu, tables)


def _packed(lidar: LidarBatch, part: slice, begin: float) -> np.ndarray:
    intensity = None if lidar.intensity is None else lidar.intensity[part]
    ring = None if lidar.ring is None else lidar.ring[part]
    # Cut a moment early, a point may be that much before the start.
    times = np.maximum(lidar.times[part], begin)
    return scans.packed(lidar.points[part], times, intensity, ring, begin)


def _imu(samples: Samples, *, stabilized: bool) -> Imu | None:
    if samples.imu is None:
        return None
    times, gyro, accel = samples.imu.times, samples.imu.gyro, samples.imu.accel
    turned = attitude.integrated(times, gyro, attitude.rest_bias(times, gyro, accel))
    stamps_ns = samples.start_ns + np.rint(1e9 * times).astype(np.int64)
    if not stabilized:
        still = np.tile(geometry.IDENTITY_QUAT_XYZW, (len(times), 1))
        return Imu(stamps_ns, gyro, accel, still, turned)
    # What the gyro has seen is in the points' frame already.
    return Imu(stamps_ns, np.zeros_like(gyro), geometry.rotate(turned, accel), turned, turned)


def _head(samples: Samples, payload: Payload, cut: Cut) -> Head:
    near = 0.0 if cut.kind == "sweeps" else REACH
    names = ("gyro_noise", "accel_noise", "gyro_bias_walk", "accel_bias_walk")
    return Head(
        kind=cut.kind,
        T_body_lidar=cut.T_body_lidar.tolist(),
        rows=cut.shape[0],
        columns=cut.shape[1],
        period=float(np.median(np.diff(cut.begins))),
        min_range=max(0.0, payload.lidar.min_range - near),
        max_range=payload.lidar.max_range,
        noise={} if samples.imu is None else {n: getattr(payload.imu, n) for n in names},
        starts_ns=[samples.start_ns + round(1e9 * t) for t in cut.begins],
        ends_ns=[samples.start_ns + round(1e9 * t) for t in cut.ends],
    )
