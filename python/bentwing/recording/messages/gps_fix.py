# SPDX-License-Identifier: MIT OR Apache-2.0
"""gps_common/GPSFix, and gps_msgs/GPSFix of ROS 2, which has the same fields."""

from __future__ import annotations

import struct

from bentwing.recording.messages.wire import align, broken_if_malformed, header

GPS_FIX = frozenset({"gps_common/msg/GPSFix", "gps_msgs/msg/GPSFix"})
_NUMBERS = 34  # from the latitude to the last of the covariance
_UNKNOWN, _DIAGONAL = 0, 2  # position_covariance_type
# Standard deviation, m, level and up, that the status of a fix stands for where nothing else does: a
# correction of satellites or ground, differential, real-time kinematic fixed and float.
_OF_STATUS = {1: (1.0, 2.0), 2: (0.7, 1.4), 18: (0.7, 1.4), 19: (0.02, 0.03), 20: (0.3, 0.5), 33: (1.0, 2.0)}  # fmt: skip
_FLOAT, _FLOAT_LEAST = 20, 0.01  # m²; receivers take floating ambiguities for better than they are
# 95 % of the errors are below what the message states: of a plane, and of a height.
_LEVEL_95, _UP_95 = 2.45, 1.96


@broken_if_malformed
def gps_fix(raw: bytes, *, cdr: bool) -> tuple[int, int, tuple[float, ...], int]:
    """Return the same as `nav_sat_fix`: stamp in ns, status, place and covariance (12), covariance type.

    Where the message has no covariance, its stated errors or its status stand for one.
    """
    stamp, position, order = header(raw, cdr=cdr)
    status, position = _status(raw, position, order, cdr=cdr)
    position = align(position, 8, cdr=cdr)
    numbers = struct.unpack_from(f"{order}{_NUMBERS}d", raw, position)
    kind = raw[position + 8 * _NUMBERS]
    place, covariance = numbers[:3], numbers[-9:]
    err_level, err_up = numbers[16:18]
    if kind == _UNKNOWN and err_level > 0 and err_up > 0:
        kind, covariance = _DIAGONAL, _diagonal(err_level / _LEVEL_95, err_up / _UP_95)
    elif kind == _UNKNOWN and status in _OF_STATUS:
        kind, covariance = _DIAGONAL, _diagonal(*_OF_STATUS[status])
    if status == _FLOAT:
        covariance = tuple(
            max(v, _FLOAT_LEAST) if k in {0, 4, 8} else v for k, v in enumerate(covariance)
        )
    return stamp, status, (*place, *covariance), kind


def _status(raw: bytes, position: int, order: str, *, cdr: bool) -> tuple[int, int]:
    """Return what a gps_common/GPSStatus says, and the position behind it."""
    # a header of its own: sequence number in ROS 1 only, seconds, nanoseconds, frame
    position = align(position, 4, cdr=cdr) + (8 if cdr else 12)
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    position = align(position + 4 + size, 2, cdr=cdr) + 2
    position = _behind_list(raw, position, order, cdr=cdr)
    position = align(position, 2, cdr=cdr) + 2
    for _ in range(4):
        position = _behind_list(raw, position, order, cdr=cdr)
    position = align(position, 2, cdr=cdr)
    (status,) = struct.unpack_from(f"{order}h", raw, position)
    return status, position + 8


def _behind_list(raw: bytes, position: int, order: str, *, cdr: bool) -> int:
    position = align(position, 4, cdr=cdr)
    (size,) = struct.unpack_from(f"{order}I", raw, position)
    return position + 4 + 4 * int(size)


def _diagonal(level: float, up: float) -> tuple[float, ...]:
    return (level**2, 0.0, 0.0, 0.0, level**2, 0.0, 0.0, 0.0, up**2)
