# SPDX-License-Identifier: MIT OR Apache-2.0
"""The motion of a joint by a recording's /tf, read as the angle of an encoder about the payload's axis."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import RecordingError
from bentwing.recording.messages import wire_transforms
from bentwing.recording.messages.wire import BrokenMessageError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.containers.interface import Source
    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.link_chain import Link
    from bentwing.recording.sections.encoder import Encoder

MOST_LOOKED_AT, ENOUGH = 5000, 200  # messages of /tf, and of the joint in them
MAX_WOBBLE = np.radians(2.0)  # by which the axis of a joint may lean about the payload's
LEAST_TURN = np.radians(5.0)  # that shows an axis
MAX_SHIFT = 0.005  # m, by which a joint that only turns may move
LEAST_TWIST = 1e-3  # of the part of a quaternion that tells the angle


class TfJoint(NamedTuple):
    """A joint of /tf: T_parent_child = T_parent_motor · Rot(axis, θ).

    Attributes
    ----------
    parent, child : frames
    axis : unit vector in the child's frame
    """

    parent: str
    child: str
    axis: tuple[float, float, float]

    @classmethod
    def of(cls, encoder: Encoder | None) -> TfJoint | None:
        """Return the joint that a payload names, if it names one."""
        if encoder is None or encoder.from_tf is None:
            return None
        given = encoder.from_tf
        return cls(given.parent.strip("/"), given.child.strip("/"), encoder.axis)

    def read(self, raw: bytes, *, cdr: bool) -> tuple[int, float | None]:
        """Return stamp, ns, and angle, rad; None in a message without the joint, NaN in a damaged one.

        Raises
        ------
        BrokenMessageError
        """
        found = wire_transforms.stamped_transforms(raw, cdr=cdr)
        for stamp_ns, link in found:
            if (link.parent, link.child) == (self.parent, self.child):
                return stamp_ns, self.angle(link)
        return found[0][0] if found else 0, None

    def angle(self, link: Link) -> float:
        """Return how far the joint is turned, rad; NaN where that cannot be told."""
        sine, cosine = self._twist(link)
        known = np.hypot(sine, cosine) > LEAST_TWIST
        return float(2.0 * np.arctan2(sine, cosine)) if known else np.nan

    def at_zero(self, link: Link) -> Link:
        """Return the link as it is at the angle 0: where the motor is in the parent's frame."""
        half = 0.5 * np.nan_to_num(self.angle(link))
        back = np.array([*(-np.sin(half) * np.array(self.axis)), np.cos(half)])
        quat = np.array(link.quaternion)
        x, y, z, w = geometry.multiply(quat / np.linalg.norm(quat), back).tolist()
        return link._replace(quaternion=(x, y, z, w))

    def _twist(self, link: Link) -> tuple[float, float]:
        quat = np.array(link.quaternion)
        return float(quat[:3] @ self.axis), float(quat[3])

    def links(self, source: Source, topics: set[str]) -> list[tuple[int, int, Link]]:
        """Return the first messages of the joint: recorder's time and stamp, ns, and link."""
        found = []
        for _, recorder_ns, raw in itertools.islice(source.messages(topics), MOST_LOOKED_AT):
            try:
                every = wire_transforms.stamped_transforms(raw, cdr=source.cdr)
            except BrokenMessageError:
                continue
            found += [
                (recorder_ns, stamp_ns, link)
                for stamp_ns, link in every
                if (link.parent, link.child) == (self.parent, self.child)
            ]
            if len(found) >= ENOUGH:
                break
        return found


def first_link(source: Source, topic: TopicInfo, joint: TfJoint) -> tuple[int, int]:
    """Return recorder's time and stamp, ns, of the first message of a joint.

    Raises
    ------
    RecordingError
        There is none, or it does not turn about the payload's axis.
    """
    found = joint.links(source, {topic.name})
    where = f"{topic.name}: the joint between {joint.parent} and {joint.child}"
    if not found:
        msg = f"{where} does not come in it; correct 'encoder: {{from_tf: ...}}' in the payload"
        raise RecordingError(msg)
    links = [link for _, _, link in found]
    axis = _own_axis(links)
    if axis is not None and np.linalg.norm(np.cross(axis, joint.axis)) > np.sin(MAX_WOBBLE):
        x, y, z = np.round(axis, 3) + 0.0
        msg = (
            f"{where} does not turn about the payload's encoder.axis, but about [{x:.3f}, {y:.3f}, "
            f"{z:.3f}] in the frame of {joint.child}; give that"
        )
        raise RecordingError(msg)
    if not np.isfinite([joint.angle(link) for link in links]).all():
        msg = (
            f"{where} is upside down about its axis or damaged, so its angle cannot be told; record it "
            "as sensor_msgs/JointState"
        )
        raise RecordingError(msg)
    places = np.array([link.translation for link in links])
    if (shift := float(np.ptp(places, axis=0).max())) > MAX_SHIFT:
        msg = f"{where} moves by {shift:.3f} m while it turns, so it is no motor's; name the frame that only turns"
        raise RecordingError(msg)
    return found[0][:2]


def _own_axis(links: list[Link]) -> NDArray[np.float64] | None:
    """Return the axis about which a joint turns most, (3,), child's frame; None where it hardly turns."""
    quats = np.array([link.quaternion for link in links])
    quats /= np.linalg.norm(quats, axis=1, keepdims=True)
    turned = geometry.log(geometry.multiply(geometry.inverse(quats[:1]), quats))
    angles = np.linalg.norm(turned, axis=1)
    most = int(np.nan_to_num(angles).argmax())
    if not angles[most] >= LEAST_TURN:
        return None
    axis = turned[most] / angles[most]
    # Either sense of the axis describes the same turn.
    return np.asarray(axis * np.sign(axis[np.abs(axis).argmax()]))
