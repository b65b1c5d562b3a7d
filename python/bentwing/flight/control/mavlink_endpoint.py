# SPDX-License-Identifier: MIT OR Apache-2.0
"""Messages of one autopilot at a MAVLink endpoint, and of nobody else."""

from __future__ import annotations

import os
import time
from collections import Counter
from itertools import islice
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_AT_ONCE = 500  # messages that one call takes; an autopilot sends some hundred a second
KEY_BYTES = 32
_DATAGRAM = 65_535
_SILENCE = 5.0  # s after which a sender may have another address, as after a restart
_STICKS = "MANUAL_CONTROL"


class Endpoint:
    """An endpoint that takes the messages of one system and component, and answers only to them.

    Over UDP the address that an accepted message has come from is the only one until it has been silent
    for some seconds. What is left out is counted in `refused` by the reason.

    Parameters
    ----------
    address : as pymavlink has it
    system : number of this system
    peer : numbers of the system and the component that are listened to
    pilot : number of the system whose sticks count as well
    key : of 32 bytes, with which messages are signed and have to be

    Raises
    ------
    UsageError
        If pymavlink is not installed, the key has another length, or the address cannot be opened.
    """

    def __init__(
        self,
        address: str,
        *,
        system: int,
        peer: tuple[int, int],
        pilot: int | None = None,
        key: bytes | None = None,
    ) -> None:
        if key is not None and len(key) != KEY_BYTES:
            msg = f"key: expected {KEY_BYTES} bytes, got {len(key)}"
            raise UsageError(msg)
        self._system, self._peer, self._pilot = system, peer, pilot
        self.connection = _opened(address, system)
        self.refused: Counter[str] = Counter()
        self._is_server = getattr(self.connection, "udp_server", None)
        self._found: Any = None
        self._heard = -_SILENCE
        if key is not None:
            self.connection.setup_signing(key, sign_outgoing=True)

    def messages(self) -> list[Any]:
        """Return what has come, without waiting; of a flood the first part, the rest is left."""
        arrived = self._from_stream() if self._is_server is None else self._from_datagrams()
        return [message for message in islice(arrived, MOST_AT_ONCE) if message is not None]

    def _from_stream(self) -> Iterator[Any]:
        while (message := self.connection.recv_msg()) is not None:
            yield message if self._is_accepted(message) else None

    def _from_datagrams(self) -> Iterator[Any]:
        while (datagram := self._datagram()) is not None:
            data, sender = datagram
            if not self._may_come_from(sender):
                self.refused["another address"] += 1
                yield None
                continue
            for message in self.connection.mav.parse_buffer(data) or []:
                is_accepted = self._is_accepted(message)
                if is_accepted:
                    self._answer_to(sender)
                yield message if is_accepted else None

    def _datagram(self) -> tuple[bytes, Any] | None:
        try:
            data, sender = self.connection.port.recvfrom(_DATAGRAM)
        except (BlockingIOError, ConnectionRefusedError):
            return None
        return data, sender

    def _may_come_from(self, sender: object) -> bool:
        is_silent = time.monotonic() - self._heard > _SILENCE
        return self._found is None or sender == self._found or is_silent

    def _answer_to(self, sender: object) -> None:
        self._found, self._heard = sender, time.monotonic()
        if self._is_server:
            self.connection.clients = {sender}
            self.connection.clients_last_alive = {sender: time.time()}

    def _is_accepted(self, message: Any) -> bool:  # noqa: ANN401 - pymavlink is not typed
        kind = message.get_type()
        if kind == "BAD_DATA":  # among them what is not signed
            self.refused["damaged or not signed"] += 1
            return False
        sender = message.get_srcSystem(), message.get_srcComponent()
        is_pilot = kind == _STICKS and sender[0] == self._pilot
        if sender != self._peer and not is_pilot:
            self.refused["another sender"] += 1
            return False
        return True

    def close(self) -> None:
        """Close the endpoint."""
        self.connection.close()


def _opened(address: str, system: int) -> Any:  # noqa: ANN401
    mavutil = pymavlink()
    try:
        return mavutil.mavlink_connection(address, source_system=system, dialect="common")
    except (OSError, ValueError) as error:
        msg = f"{address}: cannot be opened as a MAVLink endpoint ({error})"
        raise UsageError(msg) from error


def pymavlink() -> Any:  # noqa: ANN401
    """Import pymavlink's utilities.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    # The only way to tell pymavlink the version; version 1 has no OBSTACLE_DISTANCE.
    os.environ["MAVLINK20"] = "1"
    try:
        from pymavlink import mavutil
    except ImportError as error:
        msg = "MAVLink needs pymavlink: pip install 'bentwing[mavlink]'"
        raise UsageError(msg) from error
    return mavutil
