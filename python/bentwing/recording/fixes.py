# SPDX-License-Identifier: MIT OR Apache-2.0
"""GNSS fixes of a recording: sensor_msgs/NavSatFix and gps_common/GPSFix."""

from __future__ import annotations

import struct
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bentwing.recording.messages.wire import BrokenMessageError, align, broken_if_malformed, header
from bentwing.recording.stamps import StampMonitor

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.base.clock import Clock


class Parse(Protocol):
    """Reads a message: stamp in ns, status, place and covariance (12), covariance type."""

    def __call__(self, raw: bytes, *, cdr: bool) -> tuple[int, int, tuple[float, ...], int]:
        """Raise BrokenMessageError for bytes that are no such message."""
        ...


# What a receiver that does not know its accuracy is trusted with, m, east, north and up.
UNKNOWN_SIGMAS = (3.0, 3.0, 6.0)
MIN_SIGMA = 0.005  # m; some drivers report zeros
_KNOWN_TYPES = (1, 2, 3)  # NavSatFix.position_covariance_type: approximated, diagonal, known


@dataclass(frozen=True, slots=True)
class Fixes:
    """Positions of the antenna.

    Attributes
    ----------
    times : (N,) float64, s since the recording's start, increasing
    places : (N, 3) float64, longitude and latitude in deg and height in m above the WGS 84 ellipsoid
    covariances : (N, 3, 3) float64, m², east, north, up
    counts : `messages`, `fixes`, and what was dropped or filled in for each reason
    """

    times: NDArray[np.float64]
    places: NDArray[np.float64]
    covariances: NDArray[np.float64]
    counts: Counter[str]


@broken_if_malformed
def nav_sat_fix(raw: bytes, *, cdr: bool) -> tuple[int, int, tuple[float, ...], int]:
    """Stamp in ns, status, latitude, longitude, altitude and covariance (12), covariance type."""
    stamp, position, order = header(raw, cdr=cdr)
    (status,) = struct.unpack_from("b", raw, position)
    position = align(align(position + 1, 2, cdr=cdr) + 2, 8, cdr=cdr)
    values = struct.unpack_from(f"{order}12d", raw, position)
    return stamp, status, values, raw[position + 96]


def read_fixes(
    messages: Iterable[tuple[str, int, bytes]],
    clock: Clock,
    *,
    cdr: bool,
    parse: Parse | None = None,
    begin: float = 0.0,
    end: float = float("inf"),
) -> Fixes:
    """Read the fixes with begin ≤ t < end, s.

    Parameters
    ----------
    messages : topic, recorder's time in ns and bytes, in time order, of one topic
    clock : of the recording
    cdr : ROS 2's encoding instead of ROS 1's
    parse : of the messages' type; default: `nav_sat_fix`
    """
    parse = parse or nav_sat_fix
    counts: Counter[str] = Counter()
    parsed = []
    topic = ""
    for topic, recorder_ns, raw in messages:  # noqa: B007 - the name is for messages
        counts["messages"] += 1
        try:
            parsed.append((recorder_ns, *parse(raw, cdr=cdr)))
        except (BrokenMessageError, IndexError):
            counts["broken_messages"] += 1
    no_stamps = all(stamp_ns == 0 for _, stamp_ns, *_ in parsed)
    monitor = StampMonitor(topic, use_recorder_time=no_stamps, counts=counts)
    stamps_ns, rows, kinds = [], [], []
    for recorder_ns, header_ns, status, values, kind in parsed:
        stamp_ns = monitor.accept(header_ns, recorder_ns)
        if stamp_ns is None:
            continue
        if status < 0 or not _is_place(values):
            counts["no_fix"] += 1
            continue
        stamps_ns.append(stamp_ns)
        rows.append(values)
        kinds.append(kind)
    times = clock.to_seconds(np.array(stamps_ns, dtype=np.int64))
    inside = (times >= begin) & (times < end)
    table = np.array(rows, np.float64).reshape(-1, 12)[inside]
    covariances = _covariances(table[:, 3:], np.array(kinds, np.int64)[inside], counts)
    counts["fixes"] = int(np.count_nonzero(inside))
    return Fixes(times[inside], table[:, [1, 0, 2]], covariances, counts)


def _is_place(values: tuple[float, ...]) -> bool:
    latitude, longitude, height = values[:3]
    return abs(latitude) <= 90 and abs(longitude) <= 360 and abs(height) < 1e5


def _covariances(
    flat: NDArray[np.float64], kinds: NDArray[np.int64], counts: Counter[str]
) -> NDArray[np.float64]:
    """Usable covariances (N, 3, 3); what is not known, or is none, is filled in and counted."""
    covariances = flat.reshape(-1, 3, 3)
    known = np.isin(kinds, _KNOWN_TYPES) & np.isfinite(flat).all(axis=1)
    variances = np.where(known[:, None], np.diagonal(covariances, axis1=1, axis2=2), 0.0)
    known &= (variances > 0).all(axis=1) & (variances < 1e8).all(axis=1)
    counts["unknown_covariance"] += int(np.count_nonzero(~known))
    usable = np.where(known[:, None, None], covariances, np.diag(np.square(UNKNOWN_SIGMAS)))
    return positive(usable)


def positive(covariances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return covariances (N, 3, 3) m² with standard deviations of `MIN_SIGMA` and more in all directions.

    Off the diagonal some programs write anything; too much of it would be no covariance.
    """
    symmetric = 0.5 * (covariances + covariances.transpose(0, 2, 1))
    values, vectors = np.linalg.eigh(symmetric)
    values = np.maximum(values, MIN_SIGMA**2)
    filled: NDArray[np.float64] = np.einsum("nij,nj,nkj->nik", vectors, values, vectors)
    return filled
