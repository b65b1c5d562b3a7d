# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to a payload.yaml to start from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_text
from bentwing.base.errors import RecordingError
from bentwing.calibrate.draft import questions
from bentwing.calibrate.draft.joints import turning_joint
from bentwing.calibrate.draft.lidar_kind import describe_lidar
from bentwing.recording.containers.source import open_source
from bentwing.recording.frames import placed
from bentwing.recording.payload import Payload, as_payload
from bentwing.recording.tf_mount import tf_mount
from bentwing.recording.topics import ENCODER_TYPES, IMU_TYPES, LIDAR_TYPES, candidates

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.payload import PayloadLike
    from bentwing.recording.sections.self_hits import SelfHit

HEAD = """\
# The sensor head of {recordings}, as far as the recording tells it.
# What differs from the defaults is written; lines that begin with # are what is left to say.
"""


@dataclass(frozen=True, slots=True)
class Draft:
    """A payload with what is left to say of the head.

    Attributes
    ----------
    payload : as far as it is known
    recordings : from which it was made
    questions : what is not known, each as lines of YAML behind # with how to find it
    """

    payload: Payload
    recordings: tuple[str, ...]
    questions: tuple[str, ...]

    def to_yaml(self) -> str:
        """Return the text of the payload.yaml, which reads as `payload`."""
        head = HEAD.format(recordings=", ".join(self.recordings))
        return "\n".join([head + self.payload.to_yaml(), *self.questions])

    def save(self, path: Path) -> None:
        """Write the payload.yaml."""
        write_text(path, self.to_yaml())


def draft_payload(
    paths: Path | str | Sequence[Path | str],
    payload: PayloadLike = None,
    self_hits: Sequence[SelfHit] = (),
) -> Draft:
    """Return the sensor head as far as the recording tells it: topics, lidar, IMU, encoder.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : what is known already; nothing that it says is changed
    self_hits : what the lidar sees of its carrier beyond that

    Raises
    ------
    RecordingError
        It cannot be read, or has no lidar.
    """
    listed = [Path(path) for path in ([paths] if isinstance(paths, (str, Path)) else paths)]
    source = open_source(listed)
    try:
        described, others = _described(source, listed[0].stem)
        head = described if payload is None else placed(as_payload(payload), source)
        if self_hits:
            head = head.model_copy(update={"self_hits": (*head.self_hits, *self_hits)})
        asked = [*(others if payload is None else ()), *questions.of(head, source.topics)]
    finally:
        source.close()
    return Draft(head, tuple(str(path) for path in listed), tuple(asked))


def _described(source: Source, name: str) -> tuple[Payload, list[str]]:
    """Return the payload, and a question for each part that several topics could play."""
    found: dict[str, Any] = {"name": name}
    others: list[str] = []
    lidar, also = _busiest(source, "lidar", LIDAR_TYPES)
    if lidar is None:
        listed = ", ".join(f"{topic.name} [{topic.type}]" for topic in source.topics)
        msg = f"no lidar topic: the recording has {listed or 'no topics'}; record the lidar too"
        raise RecordingError(msg)
    found["lidar"], others = describe_lidar(source, lidar), [*others, *also]
    imu, also = _busiest(source, "imu", IMU_TYPES)
    if imu is not None:
        found["imu"], others = {"topic": imu.name}, [*others, *also]
    encoder, also = _busiest(source, "encoder", ENCODER_TYPES)
    joint = None if encoder is None else turning_joint(source, encoder)
    if encoder is not None and joint is not None:
        found["encoder"], others = {"topic": encoder.name} | joint, [*others, *also]
    elif imu is not None and (mount := tf_mount(source, lidar, imu)) is not None:
        others.append(questions.of_tf(mount))
        if mount.T_imu_lidar is not None:
            found["T_imu_lidar"] = mount.T_imu_lidar
    return Payload.model_validate(found), others


def _busiest(
    source: Source, role: str, types: Sequence[Sequence[str]]
) -> tuple[TopicInfo | None, list[str]]:
    """Return the topic with most messages of those that could play a part."""
    found = sorted(candidates(source.topics, role, types), key=lambda topic: -topic.count)
    if not found or not found[0].count:
        return None, []
    others = [topic.name for topic in found[1:] if topic.count]
    return found[0], [questions.other_topics(role, others)] if others else []
