# SPDX-License-Identifier: MIT OR Apache-2.0
"""A participant of DDS that ROS 2 takes for one of its own: topics found, read and written."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

from bentwing.flight.ros2.dds_types import (
    dds_type,
    kind_of,
    raw_sample,
    require_dds,
    topic_name,
)
from bentwing.recording.containers.scanned import TopicInfo

if TYPE_CHECKING:
    from collections.abc import Iterator

PREFIX = "rt/"  # of topics of ROS
DEPTH = 200  # samples kept for a slow reader, one second of most IMUs
MOST_AT_ONCE = 200


class Ros2Node:
    """Reads and writes topics of ROS 2.

    Parameters
    ----------
    domain : ROS_DOMAIN_ID

    Raises
    ------
    UsageError
        cyclonedds is not installed.
    """

    def __init__(self, domain: int) -> None:
        require_dds()
        from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsPublication
        from cyclonedds.domain import DomainParticipant

        self._participant = DomainParticipant(domain)
        self._found = BuiltinDataReader(self._participant, BuiltinTopicDcpsPublication)
        self._readers: dict[str, Any] = {}
        self._writers: dict[str, tuple[str, Any]] = {}

    def topics(self) -> list[TopicInfo]:
        """Return the topics of ROS that somebody writes now."""
        samples = self._found.read(MOST_AT_ONCE)
        found = {
            f"/{one.topic_name.removeprefix(PREFIX)}": kind
            for one in samples
            if getattr(one, "topic_name", "").startswith(PREFIX)
            and (kind := kind_of(one.type_name)) is not None
        }
        return [TopicInfo(name, kind, 1) for name, kind in sorted(found.items())]

    def subscribe(self, name: str, kind: str) -> None:
        """Read a topic, as ROS 2 reads sensors: the newest samples, without asking for lost ones."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        qos = Qos(
            Policy.Reliability.BestEffort,
            Policy.Durability.Volatile,
            Policy.History.KeepLast(DEPTH),
        )
        topic = Topic(self._participant, topic_name(name), dds_type(kind))
        self._readers[name] = DataReader(self._participant, topic, qos)

    def advertise(self, name: str, kind: str) -> None:
        """Write a topic, as ROS 2 does by default: every sample to all who ask for it."""
        from cyclonedds.core import Policy, Qos
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic
        from cyclonedds.util import duration

        qos = Qos(
            Policy.Reliability.Reliable(duration(milliseconds=100)),
            Policy.Durability.Volatile,
            Policy.History.KeepLast(10),
        )
        topic = Topic(self._participant, topic_name(name), dds_type(kind))
        self._writers[name] = kind, DataWriter(self._participant, topic, qos)

    def publish(self, name: str, raw: bytes, stamp_ns: int) -> None:  # noqa: ARG002 - in its header
        """Write a message, encoded as CDR with its head."""
        kind, writer = self._writers[name]
        writer.write(raw_sample(kind, raw))

    def take(self) -> Iterator[tuple[str, int, bytes]]:
        """Yield topic, time of arrival in ns and bytes of all that has come, each topic in its order."""
        for name, reader in self._readers.items():
            for sample in reader.take(MOST_AT_ONCE):
                if (raw := getattr(sample, "raw", None)) is not None:  # else a writer has gone
                    yield name, time.time_ns(), raw
