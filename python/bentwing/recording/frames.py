# SPDX-License-Identifier: MIT OR Apache-2.0
"""The frames of a recording's tf: the pose of one in another through the static transforms between."""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import TYPE_CHECKING

from pydantic import ValidationError

from bentwing.base.errors import PayloadError
from bentwing.base.validation import describe
from bentwing.recording.containers.source import open_source
from bentwing.recording.link_chain import along, chain, listed
from bentwing.recording.messages import wire_transforms
from bentwing.recording.messages.wire import BrokenMessageError
from bentwing.recording.payload import as_payload
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.link_chain import Link
    from bentwing.recording.payload import Payload, PayloadLike

TF_TYPES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
STATIC = "tf_static"  # how the names of topics end that hold what never changes
N_MOVING = 500  # messages of /tf, in which every joint that is sent at all comes
INSTEAD = "give translation and quaternion (or rpy, or matrix) instead of from_tf"


class Frames:
    """What a recording's /tf_static joins, and what its /tf moves."""

    def __init__(self, source: Source) -> None:
        self._source = source
        topics = [topic for topic in source.topics if topic.type in TF_TYPES and topic.count]
        self._fixed = [topic for topic in topics if topic.name.endswith(STATIC)]
        self._moved = [topic for topic in topics if not topic.name.endswith(STATIC)]

    @property
    def has_static(self) -> bool:
        """Whether the recording has a /tf_static at all."""
        return bool(self._fixed)

    def chain(self, parent: str, child: str) -> list[str]:
        """Return the frames from `parent` to `child`, both included, each fixed on the next.

        Raises
        ------
        PayloadError
            They are not joined by static transforms; the sentence says what there is.
        """
        found = chain(self._static.values(), parent, child)
        if found is None:
            raise PayloadError(self._why_not(parent, child))
        return found

    def between(self, parent: str, child: str) -> Transform:
        """Return the pose of `child` in `parent`: it takes coordinates in `child` to `parent`.

        Raises
        ------
        PayloadError
            They are not joined by static transforms, or one of these is damaged.
        """
        try:
            found = along(self._static, self.chain(parent, child))
        except ValueError as error:
            msg = f"{error} in /tf_static; {INSTEAD}"
            raise PayloadError(msg) from None
        try:
            return Transform.model_validate(found)
        except ValidationError as error:
            where = f"the pose of {child} in {parent} by /tf_static"
            raise PayloadError(describe(error, Transform, where)) from None

    @cached_property
    def _static(self) -> dict[str, Link]:
        """By child, of which tf knows one parent: the latest that was sent."""
        names = {topic.name for topic in self._fixed}
        return self._links(names, sum(topic.count for topic in self._fixed))

    def _links(self, names: set[str], most: int) -> dict[str, Link]:
        links: dict[str, Link] = {}
        for _, _, raw in itertools.islice(self._source.messages(names), most) if names else ():
            try:
                found = wire_transforms.transforms(raw, cdr=self._source.cdr)
            except BrokenMessageError:
                continue
            links |= {link.child: link for link in found}
        return links

    def _why_not(self, parent: str, child: str) -> str:
        # Only now, as /tf can be long.
        moving = self._links({topic.name for topic in self._moved}, N_MOVING)
        every = {**moving, **self._static}
        joined = chain(every.values(), parent, child)
        if joined is not None:
            joints = " and ".join(
                f"{a} and {b}"
                for a, b in itertools.pairwise(joined)
                if not _joins(self._static, a, b)
            )
            return (
                f"{child} is not fixed on {parent}: /tf sends the transform between {joints}, which a "
                "joint moves, and a moving joint of /tf is not read as an encoder yet; record the angle "
                "as sensor_msgs/JointState and describe the section encoder, or, if nothing moves "
                f"there, {INSTEAD}"
            )
        if not self.has_static:
            return (
                f"the recording has no /tf_static, which would tell the pose of {child} in {parent}: "
                f"{INSTEAD}, or record /tf_static too"
            )
        known = sorted({frame for link in every.values() for frame in (link.parent, link.child)})
        for frame in (parent, child):
            if frame not in known:
                return f"the recording has no frame {frame!r}; {listed(known, frame, 'its tf')}"
        return (
            f"no chain of static transforms joins {parent} and {child}, which are both in the "
            f"recording's tf: {INSTEAD}"
        )


def placed(payload: Payload, source: Source) -> Payload:
    """Return a payload with the transforms that it refers to, read from the recording's /tf_static.

    Raises
    ------
    PayloadError
        The recording does not tell one; the sentence names its key.
    """
    fixed = payload.T_imu_lidar
    if fixed is not None and fixed.from_tf is not None:
        read = _read(source, fixed, "T_imu_lidar")
        payload = payload.model_copy(update={"T_imu_lidar": read})
    encoder = payload.encoder
    if encoder is None:
        return payload
    of_motor = {name: getattr(encoder, name) for name in ("T_imu_motor", "T_motor_lidar")}
    update = {
        name: _read(source, given, f"encoder.{name}")
        for name, given in of_motor.items()
        if given.from_tf is not None
    }
    if not update:
        return payload
    return payload.model_copy(update={"encoder": encoder.model_copy(update=update)})


def placed_payload(paths: Sequence[Path], payload: PayloadLike) -> Payload:
    """Return the sensor head with what it refers to in a recording, which is opened only for that.

    Raises
    ------
    RecordingError, PayloadError
        The recording cannot be read, or does not tell it.
    """
    head = as_payload(payload)
    if not head.refers_to_recording:
        return head
    source = open_source(paths)
    try:
        return placed(head, source)
    finally:
        source.close()


def _read(source: Source, given: Transform, key: str) -> Transform:
    reference = given.from_tf
    if reference is None:
        return given
    try:
        return Frames(source).between(reference.parent.strip("/"), reference.child.strip("/"))
    except PayloadError as error:
        msg = f"{key}.from_tf: {error}"
        raise PayloadError(msg) from None


def _joins(links: dict[str, Link], a: str, b: str) -> bool:
    return any(
        child in links and links[child].parent == parent for parent, child in ((a, b), (b, a))
    )
