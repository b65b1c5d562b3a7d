# SPDX-License-Identifier: MIT OR Apache-2.0
"""What turns the messages of one type into points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, ClassVar, Generic, Protocol, TypeVar

from bentwing.recording.attributes import NO_ATTRIBUTES
from bentwing.recording.messages import wire

if TYPE_CHECKING:
    from collections import Counter
    from collections.abc import Sequence

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.recording.attributes import Attributes
    from bentwing.recording.batches import LidarBatch
    from bentwing.recording.point_times import GivenTimes, Reading
    from bentwing.recording.sweep_stamps import SweepStamps


class Stamped(Protocol):
    """A message that is read."""

    @property
    def stamp_ns(self) -> int:
        """Stamp of its header."""


Message = TypeVar("Message", bound=Stamped)


class LidarDecoder(ABC, Generic[Message]):
    """Decoder of a lidar's messages.

    Parameters
    ----------
    cdr : ROS 2's encoding instead of ROS 1's
    reading : of the points' times, where `point_times` found that it needs one
    range_scale : m per unit of the ranges, where it takes limits of range from the messages; the points
        are handed out in the unit of the messages
    attributes : further fields that are wanted, see `fields`
    """

    is_planar: ClassVar[bool] = False

    def __init__(
        self,
        *,
        cdr: bool,
        reading: Reading | None = None,
        range_scale: float = 1.0,
        attributes: Attributes = NO_ATTRIBUTES,
    ) -> None:
        self.cdr = cdr
        self.reading = reading
        self.range_scale = range_scale
        self.attributes = attributes

    def fields(self, raw: bytes) -> dict[str, np.dtype[Any]]:  # noqa: ARG002 - not every type has any
        """Return the fields of a message's points that a map can carry, with their types.

        Raises
        ------
        BrokenMessageError
            It cannot be read.
        """
        return {}

    @abstractmethod
    def point_times(
        self, messages: Sequence[bytes], stamps_ns: Sequence[int], given: GivenTimes
    ) -> tuple[str | None, Reading | None]:
        """Return how the time of each point is known.

        Parameters
        ----------
        messages, stamps_ns : the first ones of the topic
        given : what the payload says of them

        Returns
        -------
        A sentence, None where the messages do not tell, and the reading of a time field if there is one.

        Raises
        ------
        PayloadError
            What the payload says does not hold for the messages.
        """

    def made_times(
        self,
        messages: Sequence[bytes],  # noqa: ARG002 - most types have times
        stamps: SweepStamps,  # noqa: ARG002
    ) -> Reading | str:
        """Return how points get times where the messages have none, or why they cannot.

        Parameters
        ----------
        messages : the first ones of the topic
        stamps : of these and more
        """
        return "its messages do not tell where it looked when"

    @abstractmethod
    def parse(self, raw: bytes, counts: Counter[str]) -> Message:
        """Read a message.

        Raises
        ------
        BrokenMessageError
            It cannot be read.
        """

    def stamp_and_span(self, raw: bytes) -> tuple[int, float | None]:
        """Return the stamp of a message, ns, and the time from its first to its last point, s.

        The time is None where the type tells nothing that its stamps do not: all scans last as long.

        Raises
        ------
        BrokenMessageError
            It cannot be read.
        """
        return wire.stamp_ns(raw, cdr=self.cdr), None

    def has_point_times(self, message: Message) -> bool:  # noqa: ARG002 - most types do not vary
        """Whether a message tells when each of its points was measured."""
        return True

    @abstractmethod
    def batches(
        self, messages: Sequence[Message], starts: NDArray[np.float64], counts: Counter[str]
    ) -> list[LidarBatch]:
        """Return the points of messages with stamps (M,), s since the recording's start.

        `counts` receives `returns` and, by reason, those that are left out.
        """
