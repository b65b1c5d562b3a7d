# SPDX-License-Identifier: MIT OR Apache-2.0
"""Cut a stream of points into the scans that other engines take, and put them into one frame."""

from __future__ import annotations

import numpy as np

from bentwing.base import geometry
from bentwing.base.transform import apply

JOINED = 0.5
"""s; sweeps of a motor-turned lidar in one scan. Single ones see too little for a scan matcher."""
LONGEST = 1.5
"""s; a scan that waited longer for its half turn keeps its last points only."""
POINT = np.dtype(
    [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4"), ("t", "<u4"), ("ring", "<u2")]
)
"""t: ns since the start of the scan."""


def cut(times: np.ndarray, starts: np.ndarray, longest: float = np.inf) -> list[slice]:
    """Rows of each scan, without empty ones.

    Parameters
    ----------
    times : (N,) s, non-decreasing
    starts : (K,) s, increasing; what is before the first belongs to no scan
    longest : s; of a longer scan the last part
    """
    first = np.searchsorted(times, starts)
    last = np.append(first[1:], len(times))
    late = np.searchsorted(times, times[np.maximum(last - 1, 0)] - longest)
    first = np.maximum(first, late)
    return [slice(int(a), int(b)) for a, b in zip(first, last, strict=True) if b > a]


def grid(times: np.ndarray, period: float = JOINED) -> np.ndarray:
    """Starts of scans of one length, from the first point on."""
    return np.arange(times[0], times[-1], period)


def half_turns(times: np.ndarray, rates: np.ndarray) -> np.ndarray:
    """Starts of scans in which a spun or nodding 2D lidar has swept half a turn.

    Parameters
    ----------
    times : (M,) s
    rates : (M, 3) rad/s; the axis is that about which most of the turning is done
    """
    _, axes = np.linalg.eigh(rates.T @ rates)
    swept = np.abs(rates @ axes[:, -1])
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (swept[1:] + swept[:-1]) * np.diff(times))])
    turns = np.floor(angle / np.pi)
    return times[np.flatnonzero(np.diff(turns, prepend=-1.0) > 0)]


def by_encoder(points: np.ndarray, angles: np.ndarray, encoder) -> np.ndarray:
    """Points (N, 3) of the lidar in the IMU frame, by the motor's angles (N,) and nominal mounts."""
    in_motor = apply(encoder.T_motor_lidar.pose.matrix, points)
    turns = geometry.exp((angles + encoder.zero)[:, None] * np.array(encoder.axis))
    return apply(encoder.T_imu_motor.pose.matrix, geometry.rotate(turns, in_motor))


def packed(
    points: np.ndarray,
    times: np.ndarray,
    intensity: np.ndarray | None,
    ring: np.ndarray | None,
    start: float,
) -> np.ndarray:
    """One scan as a table of `POINT`."""
    table = np.zeros(len(points), POINT)
    table["x"], table["y"], table["z"] = points.T
    table["t"] = np.rint(1e9 * (times - start))
    if intensity is not None:
        table["intensity"] = intensity
    if ring is not None:
        table["ring"] = ring
    return table


def column_by_time(scan: np.ndarray, step: float) -> np.ndarray:
    """Column (N,) of each shot of a sweep whose beams fire every `step` s."""
    # Rounded to the step below but for what whole nanoseconds have taken away.
    return (1e-9 * scan["t"] / step + 1e-3).astype(int)


def column_by_order(scan: np.ndarray) -> np.ndarray:
    """Column (N,) by the order in each ring, where it is not known when beams fire."""
    order = np.argsort(scan["ring"], kind="stable")
    rings = scan["ring"][order]
    columns = np.empty(len(scan), int)
    columns[order] = np.arange(len(scan)) - np.searchsorted(rings, rings)
    return columns


def organised(scan: np.ndarray, shape: tuple[int, int], column: np.ndarray) -> np.ndarray:
    """Row by row with a place for every shot, as a driver would publish it; no return is all zero.

    Parameters
    ----------
    scan : (N,) of `POINT`, one sweep
    shape : beams, and shots of each per sweep
    column : (N,) of each shot
    """
    image = np.zeros(shape, POINT)
    image["ring"] = np.arange(shape[0])[:, None]
    image[scan["ring"], np.minimum(column, shape[1] - 1)] = scan
    return image.reshape(-1)
