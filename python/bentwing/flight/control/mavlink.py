# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flight link over MAVLink 2, through pymavlink (extra `mavlink`)."""

from __future__ import annotations

import math
import os
from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import UsageError
from bentwing.flight.control.link import Attitude, Distance, Message, Sticks
from bentwing.flight.control.springs import N_SECTORS

if TYPE_CHECKING:
    from typing_extensions import Self

    from bentwing.flight.control.springs import Springs

_TEXT = 50  # characters of a STATUSTEXT
_UNKNOWN = 65535  # cm, of OBSTACLE_DISTANCE
_FULL_STICK = 1000.0  # of MANUAL_CONTROL


class MavlinkLink:
    """A `FlightLink` to a MAVLink endpoint.

    MAVLink's body is forward, right, down with the nose up for positive pitch, and its yaw is
    clockwise: pitch and yaw change their sign here and nowhere else. Messages that are not finite
    or out of range are dropped and counted in `refused`.

    Parameters
    ----------
    address : as pymavlink has it: udpin:0.0.0.0:14550, udpout:127.0.0.1:14551, /dev/ttyACM0
    system : number of this system
    target : number of the autopilot's system

    Raises
    ------
    UsageError
        If pymavlink is not installed, or the address cannot be opened.
    """

    def __init__(self, address: str, *, system: int = 1, target: int = 1) -> None:
        mavutil = _mavutil()
        self._dialect = mavutil.mavlink
        try:
            self._connection: Any = mavutil.mavlink_connection(
                address, source_system=system, dialect="common"
            )
        except (OSError, ValueError) as error:
            msg = f"{address}: cannot be opened as a MAVLink endpoint ({error})"
            raise UsageError(msg) from error
        self._target = target
        self._time_ms = 0
        self.refused: Counter[str] = Counter()

    def receive(self) -> list[Message]:
        """Return what has come since the last call, oldest first, without waiting."""
        found: list[Message] = []
        while (raw := self._connection.recv_msg()) is not None:
            kind = raw.get_type()
            if kind not in _READERS:
                continue
            self._time_ms = getattr(raw, "time_boot_ms", self._time_ms)
            message = _READERS[kind](raw)
            if message is None:
                self.refused[kind] += 1
            else:
                found.append(message)
        return found

    def send_attitude(self, roll: float, pitch: float, yaw: float, thrust: float) -> None:
        """Command an attitude (rad) and a thrust 0 … 1, as SET_ATTITUDE_TARGET.

        Raises
        ------
        ValueError
            If a value is not finite or the thrust is out of range: nothing is sent.
        """
        if not all(map(math.isfinite, (roll, pitch, yaw, thrust))) or not 0.0 <= thrust <= 1.0:
            msg = f"attitude: expected finite angles and a thrust of 0 to 1, got {roll}, {pitch}, {yaw}, {thrust}"
            raise ValueError(msg)
        turns = [geometry.exp(np.array(v)) for v in ([0, 0, -yaw], [0, -pitch, 0], [roll, 0, 0])]
        x, y, z, w = geometry.multiply(geometry.multiply(turns[0], turns[1]), turns[2]).ravel()
        mask = (
            self._dialect.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE
            | self._dialect.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE
            | self._dialect.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE
        )
        self._connection.mav.set_attitude_target_send(
            self._time_ms, self._target, 1, mask, [w, x, y, z], 0.0, 0.0, 0.0, thrust
        )

    def send_gaps(self, springs: Springs, yaw: float) -> None:
        """Tell the gaps around the hull as OBSTACLE_DISTANCE, clockwise from ahead."""
        distances = np.full(N_SECTORS, _UNKNOWN)
        azimuths = np.arctan2(springs.directions[:, 1], springs.directions[:, 0]) - yaw
        sectors = np.rint(-azimuths * N_SECTORS / (2 * np.pi)).astype(np.int64) % N_SECTORS
        centimetres = np.rint(100.0 * springs.gaps).clip(0, _UNKNOWN - 1).astype(np.int64)
        np.minimum.at(distances, sectors, centimetres)
        self._connection.mav.obstacle_distance_send(
            1000 * self._time_ms,
            self._dialect.MAV_DISTANCE_SENSOR_LASER,
            distances.tolist(),
            360 // N_SECTORS,
            0,
            _UNKNOWN - 1,
            360.0 / N_SECTORS,
            0.0,
            self._dialect.MAV_FRAME_BODY_FRD,
        )

    def send_warning(self, sentence: str) -> None:
        """Tell the pilot something in at most 50 characters, as STATUSTEXT."""
        text = sentence.encode("ascii", "replace")[:_TEXT]
        self._connection.mav.statustext_send(self._dialect.MAV_SEVERITY_WARNING, text)

    def close(self) -> None:
        """Close the endpoint."""
        self._connection.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _attitude(raw: Any) -> Attitude | None:  # noqa: ANN401 - pymavlink is not typed
    if not all(map(math.isfinite, (raw.roll, raw.pitch, raw.yaw))):
        return None
    return Attitude(1e-3 * raw.time_boot_ms, raw.roll, -raw.pitch, -raw.yaw)


def _distance(raw: Any) -> Distance | None:  # noqa: ANN401
    if not raw.min_distance <= raw.current_distance <= raw.max_distance:
        return None
    downward = raw.orientation == _mavutil().mavlink.MAV_SENSOR_ROTATION_PITCH_270
    return Distance(1e-3 * raw.time_boot_ms, 1e-2 * raw.current_distance, downward)


def _sticks(raw: Any) -> Sticks | None:  # noqa: ANN401
    if max(abs(raw.x), abs(raw.y), abs(raw.z)) > _FULL_STICK:
        return None
    return Sticks(raw.y / _FULL_STICK, raw.x / _FULL_STICK, max(raw.z, 0) / _FULL_STICK)


_READERS = {"ATTITUDE": _attitude, "DISTANCE_SENSOR": _distance, "MANUAL_CONTROL": _sticks}


def _mavutil() -> Any:  # noqa: ANN401 - pymavlink is not typed
    # The only way to tell pymavlink the version; version 1 has no OBSTACLE_DISTANCE.
    os.environ["MAVLINK20"] = "1"
    try:
        from pymavlink import mavutil
    except ImportError as error:
        msg = "MAVLink needs pymavlink: pip install 'bentwing[mavlink]'"
        raise UsageError(msg) from error
    return mavutil
