# SPDX-License-Identifier: MIT OR Apache-2.0
"""IMUs that fail, that are of another flight, or that feel something else than the lidar sees."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.faults.fault import Changes, Fault, Subject
from bentwing.simulate.faults.inertial import GRAVITY
from bentwing.simulate.faults.messages import accel, gyro, set_accel, set_gyro, stamp_ns

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.faults.fault import Message

    Array = NDArray[np.float64]

SLOW = 20
"""Of so many samples one is left: 10 of 200 Hz."""
RIDE = 0.4, 0.75
"""Shares of the recording when a cabin sets off and when it has arrived."""
PUSH, PUSH_S = 1.2, 2.0
"""m/s² and s of a cabin's start: 1.5 m/s."""

_DISAGREES = r"(IMU|gyro|acceler).*(not|dis).*(agree|belong|fit|match|explain)|otherwise than the"


def _frozen(subject: Subject) -> Changes:
    middle = subject.at_share(0.5)
    last: list[Array] = []

    def edit(message: Message) -> Message:
        if stamp_ns(message) < middle or not last:
            last[:] = gyro(message), accel(message)
        else:
            set_gyro(message, last[0])
            set_accel(message, last[1])
        return message

    return Changes(imu=edit)


def _slow(_: Subject) -> Changes:
    n = -1

    def edit(message: Message) -> Message | None:
        nonlocal n
        n += 1
        return None if n % SLOW else message

    return Changes(imu=edit)


def _of_another(subject: Subject) -> Changes:
    # The simulation takes long to import, and only this fault needs it.
    from bentwing.simulate.faults.another import another_imu

    samples = another_imu(subject.folder)

    def edit(message: Message) -> Message | None:
        sample = next(samples, None)
        if sample is None:
            return None
        set_gyro(message, sample[:3])
        set_accel(message, sample[3:])
        return message

    return Changes(imu=edit)


def _without_gravity(subject: Subject) -> Changes:
    up = np.array([0.0, 0.0, GRAVITY])

    def edit(message: Message) -> Message:
        set_accel(message, accel(message) - subject.attitude(message).T @ up)
        return message

    return Changes(imu=edit)


def _in_cabin(subject: Subject) -> Changes:
    """Let a cabin go up with all that is in it: only the accelerometer feels it."""
    start, end = (subject.at_share(share) for share in RIDE)

    def edit(message: Message) -> Message:
        stamp = stamp_ns(message)
        pushed = _push(1e-9 * (stamp - start)) - _push(1e-9 * (end - stamp))
        set_accel(message, accel(message) + subject.attitude(message).T @ [0.0, 0.0, pushed])
        return message

    return Changes(imu=edit)


def _push(since: float) -> float:
    return PUSH * float(np.sin(np.pi * since / PUSH_S)) if 0.0 <= since <= PUSH_S else 0.0


FAULTS = (
    Fault(
        "accel-no-gravity",
        "The driver has removed gravity from the accelerations.",
        _without_gravity,
        "none",
        r"gravity.*(removed|missing|taken|without|subtracted|lack)|(without|no|lack).*gravity",
    ),
    Fault(
        "imu-of-another",
        "The IMU's samples are those of another flight.",
        _of_another,
        "none",
        rf"another (recording|flight)|{_DISAGREES}",
    ),
    Fault(
        "imu-frozen",
        "Half way on, the IMU repeats one sample.",
        _frozen,
        "none",
        r"(IMU|gyro|acceler).*(froze|stop|repeat|constant|same|stuck|not change)",
    ),
    Fault(
        "imu-10hz",
        "The IMU sends 10 samples a second.",
        _slow,
        "none",
        r"\bHz\b|too (slow|few)|samples (a|per) second",
    ),
    Fault(
        "elevator",
        "A cabin moves up with the head and all it sees, and the IMU feels that.",
        _in_cabin,
        "none",
        rf"elevator|vehicle|cabin|moves along|{_DISAGREES}",
    ),
)
