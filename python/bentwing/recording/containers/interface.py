# SPDX-License-Identifier: MIT OR Apache-2.0
"""What all containers of recordings have in common."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from bentwing.recording.containers.scanned import TopicInfo


class Source(Protocol):
    """One or several files as one stream of raw messages.

    `start_ns` and `end_ns` are on the recorder's clock; `cdr` tells ROS 2's encoding from ROS 1's.
    """

    topics: tuple[TopicInfo, ...]
    start_ns: int
    end_ns: int
    cdr: bool

    @property
    def warnings(self) -> list[str]:
        """Sentences about damage; grows while a damaged file is read."""

    def messages(
        self, topics: Collection[str], start_ns: int | None = None
    ) -> Iterator[tuple[str, int, bytes]]:
        """Yield (topic, recorder's time in ns, bytes) of the named topics in time order."""

    def close(self) -> None:
        """Close the files."""
