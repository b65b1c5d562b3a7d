# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flight link over MAVLink 2, through pymavlink (extra `mavlink`)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.flight.control.link import Attitude, Distance, Message, Sticks
from bentwing.flight.control.mavlink_endpoint import Endpoint, pymavlink
from bentwing.flight.control.springs import N_SECTORS

if TYPE_CHECKING:
    from collections import Counter

    from typing_extensions import Self

    from bentwing.flight.control.springs import Springs

LOOPBACK = "udpin:127.0.0.1:14550"
_TEXT = 50  # characters of a STATUSTEXT
_UNKNOWN = 65535  # cm, of OBSTACLE_DISTANCE
_FULL_STICK = 1000.0  # of MANUAL_CONTROL


class MavlinkLink:
    """A `FlightLink` to a MAVLink endpoint.

    MAVLink's body is forward, right, down with the nose up for positive pitch, and its yaw is
    clockwise: pitch and yaw change their sign here and nowhere else. Messages that are not finite
    or out of range, not of the autopilot, or not signed where they have to be, are dropped and counted
    in `refused`.

    Parameters
    ----------
    address : as pymavlink has it: udpin:127.0.0.1:14550, udpout:192.168.1.10:14551, /dev/ttyACM0.
        `udpin:0.0.0.0:14550` hears whoever reaches this computer: give it with a `key` only
    system : number of this system
    target, component : numbers of the autopilot's system and component; nobody else is heard
    pilot : number of the ground station whose MANUAL_CONTROL has the pilot's sticks; default: the
        autopilot passes them on itself
    key : 32 bytes that the autopilot has too: MAVLink 2 messages are signed with it, and others are
        refused

    Raises
    ------
    UsageError
        If pymavlink is not installed, the key has another length, or the address cannot be opened.
    """

    def __init__(
        self,
        address: str = LOOPBACK,
        *,
        system: int = 1,
        target: int = 1,
        component: int = 1,
        pilot: int | None = None,
        key: bytes | None = None,
    ) -> None:
        peer = target, component
        self._endpoint = Endpoint(address, system=system, peer=peer, pilot=pilot, key=key)
        self._connection = self._endpoint.connection
        self._dialect = pymavlink().mavlink
        self._peer = peer
        self._time_ms = 0
        self.refused: Counter[str] = self._endpoint.refused

    def receive(self) -> list[Message]:
        """Return what has come since the last call, oldest first, without waiting."""
        found: list[Message] = []
        for raw in self._endpoint.messages():
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
            self._time_ms, *self._peer, mask, [w, x, y, z], 0.0, 0.0, 0.0, thrust
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
        self._endpoint.close()

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
    downward = raw.orientation == pymavlink().mavlink.MAV_SENSOR_ROTATION_PITCH_270
    return Distance(1e-3 * raw.time_boot_ms, 1e-2 * raw.current_distance, downward)


def _sticks(raw: Any) -> Sticks | None:  # noqa: ANN401
    if max(abs(raw.x), abs(raw.y), abs(raw.z)) > _FULL_STICK:
        return None
    return Sticks(raw.y / _FULL_STICK, raw.x / _FULL_STICK, max(raw.z, 0) / _FULL_STICK)


_READERS = {"ATTITUDE": _attitude, "DISTANCE_SENSOR": _distance, "MANUAL_CONTROL": _sticks}
