# SPDX-License-Identifier: MIT OR Apache-2.0
"""Live odometry in Foxglove: a server that its app connects to."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.flight.live.messages import LiveMessages
from bentwing.recording.messages.ros_messages import RosMessages

if TYPE_CHECKING:
    from typing_extensions import Self

    from bentwing.flight.live.odometry import Odometry
    from bentwing.flight.live.prediction import StampedPose

PORT = 8765  # that Foxglove proposes


class FoxgloveServer:
    """Shows live odometry in Foxglove: pose, /tf, path, map and status, as messages of ROS 2.

    Parameters
    ----------
    port : to listen on; 0: any free one
    host : address to listen on; 0.0.0.0: also for other computers
    start_ns : ns UTC of the time 0 of the odometry

    Raises
    ------
    UsageError
        If foxglove-sdk is not installed, or the address cannot be listened on.
    """

    def __init__(self, port: int = PORT, *, host: str = "127.0.0.1", start_ns: int = 0) -> None:
        try:
            # A name that type checkers without the package need not find.
            self._sdk: Any = importlib.import_module("foxglove")
        except ImportError as error:
            msg = (
                f"Foxglove needs foxglove-sdk, which cannot be loaded ({error}); install it with "
                "`pip install foxglove-sdk`"
            )
            raise UsageError(msg) from None
        self._context = self._sdk.Context()
        try:
            self._server = self._sdk.start_server(
                name="bentwing", host=host, port=port, context=self._context
            )
        except (OSError, RuntimeError, ValueError) as error:
            msg = f"cannot listen on {host}:{port} ({error}); give another port"
            raise UsageError(msg) from None
        self._start_ns = start_ns
        self._types = RosMessages().types
        self._channels: dict[str, Any] = {}
        self._says: LiveMessages | None = None

    @property
    def port(self) -> int:
        """The port that it listens on."""
        return int(self._server.port)

    def show(self, odometry: Odometry, pose: StampedPose | None = None) -> None:
        """Show what is new of an odometry, always the same one; call it often.

        Parameters
        ----------
        pose : to show; default: the newest
        """
        if self._says is None:
            self._says = LiveMessages(odometry, [self])
        self._says.say(self._start_ns, pose=pose)

    def advertise(self, name: str, kind: str) -> None:
        """Announce a topic of a type of ROS 2."""
        text, _ = self._types.generate_msgdef(kind, ros_version=2)
        schema = self._sdk.Schema(name=kind, encoding="ros2msg", data=text.encode())
        self._channels[name] = self._sdk.Channel(
            name, schema=schema, message_encoding="cdr", context=self._context
        )

    def publish(self, name: str, raw: bytes, stamp_ns: int) -> None:
        """Send a message, encoded as CDR with its head."""
        self._channels[name].log(raw, log_time=stamp_ns)

    def close(self) -> None:
        """End the server."""
        self._server.stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
