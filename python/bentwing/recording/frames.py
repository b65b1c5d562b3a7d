# SPDX-License-Identifier: MIT OR Apache-2.0
"""The frames of a recording's tf: the pose of one in another through the static transforms between."""

from __future__ import annotations

import itertools
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from pydantic import ValidationError

from bentwing.base.errors import PayloadError
from bentwing.base.validation import describe
from bentwing.recording.containers.source import open_source
from bentwing.recording.link_chain import along, chain, listed
from bentwing.recording.messages import wire_transforms
from bentwing.recording.messages.wire import BrokenMessageError
from bentwing.recording.payload import as_payload
from bentwing.recording.sections.section import Transform
from bentwing.recording.tf_joint import TfJoint
from bentwing.recording.topics import STATIC, TF_TYPES

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.link_chain import Link
    from bentwing.recording.payload import Payload, PayloadLike
    from bentwing.recording.sections.encoder import Encoder

SAME_FRAME = 1e-3  # m and rad
N_MOVING = 500  # messages of /tf, in which every joint that is sent at all comes
INSTEAD = "give translation and quaternion (or rpy, or matrix) instead of from_tf"


class Frames:
    """What a recording's /tf_static joins, and what its /tf moves.

    Parameters
    ----------
    source : the recording
    motor : the joint that is the encoder; where it leads, frames are joined as at its angle 0
    """

    def __init__(self, source: Source, motor: TfJoint | None = None) -> None:
        self._source, self._motor = source, motor
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
        links = self._links(names, sum(topic.count for topic in self._fixed))
        if self._motor is not None:
            moved = self._motor.links(self._source, {topic.name for topic in self._moved})
            links |= {link.child: self._motor.at_zero(link) for _, _, link in moved[:1]}
        return links

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
                "joint moves; name it in the section encoder as 'from_tf: {parent: ..., child: ...}', or, if "
                f"nothing moves there, {INSTEAD}"
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
    # To the motor the way may lead through the joint; from it to the lidar nothing may move.
    motors = {"T_imu_motor": TfJoint.of(encoder)}
    update = {
        name: _read(source, given, f"encoder.{name}", motors.get(name))
        for name, given in of_motor.items()
        if given.from_tf is not None
    }
    _require_motor_frame(source, encoder)
    if not update:
        return payload
    return payload.model_copy(update={"encoder": encoder.model_copy(update=update)})


def _require_motor_frame(source: Source, encoder: Encoder) -> None:
    """Refuse a motor that is placed where its joint is fixed, if the joint turns elsewhere."""
    joint, given = TfJoint.of(encoder), encoder.T_imu_motor.from_tf
    if joint is None or given is None or given.child.strip("/") != joint.parent:
        return
    T = Frames(source, joint).between(joint.parent, joint.child).pose.matrix
    if np.abs(T - np.eye(4)).max() > SAME_FRAME:
        msg = (
            f"encoder.T_imu_motor.from_tf: the joint does not turn about the origin and the axes of "
            f"{joint.parent}; give 'child: {joint.child}', which is read as at the angle 0"
        )
        raise PayloadError(msg)


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


def _read(source: Source, given: Transform, key: str, motor: TfJoint | None = None) -> Transform:
    reference = given.from_tf
    if reference is None:
        return given
    try:
        return Frames(source, motor).between(
            reference.parent.strip("/"), reference.child.strip("/")
        )
    except PayloadError as error:
        msg = f"{key}.from_tf: {error}"
        raise PayloadError(msg) from None


def _joins(links: dict[str, Link], a: str, b: str) -> bool:
    return any(
        child in links and links[child].parent == parent for parent, child in ((a, b), (b, a))
    )
