# SPDX-License-Identifier: MIT OR Apache-2.0
"""IMUs with other axes, units and scales, and IMUs that fail or feel something else."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.simulate.faults import messages
from bentwing.simulate.faults.fault import Changes, Fault, Subject
from bentwing.simulate.faults.messages import accel, gyro, set_accel, set_gyro

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.faults.fault import Edit, Message

    Array = NDArray[np.float64]
    Function = Callable[[Array], Array]

GRAVITY = 9.80665
SWAPPED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
CYCLIC = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
SATURATED = 0.4
"""Share of its largest rate at which the gyro is clipped."""
SLOW = 20
"""Of so many samples one is left: 10 of 200 Hz."""
RIDE = 0.4, 0.75
"""Shares of the recording when a cabin sets off and when it has arrived."""
PUSH, PUSH_S = 1.2, 2.0
"""m/s² and s of a cabin's start: 1.5 m/s."""

_AXES = r"ax[ie]s|mirror|sign|handed|swap|permut|direction"
_GYRO, _ACCEL = r"gyro|angular rate", r"acceler"
GYRO_AXES = rf"({_GYRO}).*({_AXES})|({_AXES}).*({_GYRO})"
ACCEL_AXES = rf"({_ACCEL}).*({_AXES})|({_AXES}).*({_ACCEL})"
IMU_AXES = rf"(IMU|{_GYRO}|{_ACCEL}).*({_AXES})|({_AXES}).*IMU|mount|T_imu_lidar"
OTHER = r"another recording|(IMU|gyro).*(not|dis).*(agree|belong|fit|match|explain)"


def _changed(on_gyro: Function | None = None, on_accel: Function | None = None) -> Edit:
    """Change the rates and the accelerations of every sample."""

    def edit(message: Message) -> Message:
        if on_gyro is not None:
            set_gyro(message, on_gyro(gyro(message)))
        if on_accel is not None:
            set_accel(message, on_accel(accel(message)))
        return message

    return edit


def _gyro(function: Function) -> Callable[[Subject], Changes]:
    return lambda _: Changes(imu=_changed(on_gyro=function))


def _accel(function: Function) -> Callable[[Subject], Changes]:
    return lambda _: Changes(imu=_changed(on_accel=function))


def _both(function: Function) -> Callable[[Subject], Changes]:
    return lambda _: Changes(imu=_changed(function, function))


def _one_negated(make: Callable[[Function], Callable[[Subject], Changes]]) -> Any:  # noqa: ANN401
    """Negate an axis that is drawn."""

    def change(subject: Subject) -> Changes:
        signs = np.where(np.arange(3) == subject.rng.integers(3), -1.0, 1.0)
        return make(lambda vector: signs * vector)(subject)

    return change


def _constant(subject: Subject) -> Changes:
    first = gyro(next(subject.imu()))
    return Changes(imu=_changed(on_gyro=lambda _: first))


def _saturated(subject: Subject) -> Changes:
    limit = SATURATED * max(float(np.abs(gyro(message)).max()) for message in subject.imu())
    return Changes(imu=_changed(on_gyro=lambda rates: rates.clip(-limit, limit)))


def _frozen(subject: Subject) -> Changes:
    middle = subject.at_share(0.5)
    last: list[Array] = []

    def edit(message: Message) -> Message:
        if messages.stamp_ns(message) < middle or not last:
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
    # Simulating takes long to import, and only this fault needs it.
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
        stamp = messages.stamp_ns(message)
        pushed = _push(1e-9 * (stamp - start)) - _push(1e-9 * (end - stamp))
        set_accel(message, accel(message) + subject.attitude(message).T @ [0.0, 0.0, pushed])
        return message

    return Changes(imu=edit)


def _push(since: float) -> float:
    return PUSH * float(np.sin(np.pi * since / PUSH_S)) if 0.0 <= since <= PUSH_S else 0.0


def _permuted(matrix: Array) -> Function:
    return lambda vector: matrix @ vector


FAULTS = (
    Fault("gyro-swapped", "The gyro's x and y are swapped.", _gyro(_permuted(SWAPPED)), "axes", GYRO_AXES),
    Fault("gyro-cyclic", "The gyro's axes are y, z and x.", _gyro(_permuted(CYCLIC)), "axes", GYRO_AXES),
    Fault("gyro-one-negated", "One axis of the gyro is negated.", _one_negated(_gyro), "axes", GYRO_AXES),
    Fault("gyro-negated", "All axes of the gyro are negated.", _gyro(np.negative), "axes", GYRO_AXES),
    Fault("gyro-zero", "The gyro reads zero.", _gyro(np.zeros_like), "none", rf"({_GYRO}).*(zero|constant|still|dead|not turn)"),
    Fault("gyro-constant", "The gyro always reads the same.", _constant, "none", rf"({_GYRO}).*(constant|same|still|stuck|zero|not change)"),
    Fault("gyro-saturated", "The gyro is clipped at two fifths of its largest rate.", _saturated, "none", rf"({_GYRO}).*(saturat|clip|full scale|limit|range)"),
    Fault("gyro-1.2", "The gyro reads 1.2 times too much.", _gyro(lambda rates: 1.2 * rates), "none", rf"({_GYRO}).*(scale|unit|factor|times|%)"),
    Fault("gyro-2", "The gyro reads twice too much.", _gyro(lambda rates: 2.0 * rates), "none", rf"({_GYRO}).*(scale|unit|factor|times|%)"),
    Fault("gyro-degrees", "The gyro is in deg/s.", _gyro(np.degrees), "units", rf"({_GYRO}).*(deg|°)"),
    Fault("accel-swapped", "The accelerometer's x and y are swapped.", _accel(_permuted(SWAPPED)), "axes", ACCEL_AXES),
    Fault("accel-cyclic", "The accelerometer's axes are y, z and x.", _accel(_permuted(CYCLIC)), "axes", ACCEL_AXES),
    Fault("accel-one-negated", "One axis of the accelerometer is negated.", _one_negated(_accel), "axes", ACCEL_AXES),
    Fault("accel-negated", "All axes of the accelerometer are negated.", _accel(np.negative), "axes", ACCEL_AXES),
    Fault("accel-g", "The accelerations are in g.", _accel(lambda force: force / GRAVITY), "units", rf"({_ACCEL}).* g\b"),
    Fault("accel-milli-g", "The accelerations are in milli-g.", _accel(lambda force: 1e3 * force / GRAVITY), "units", rf"({_ACCEL}).*(milli-g|mg)"),
    Fault("accel-no-gravity", "The driver has removed gravity from the accelerations.", _without_gravity, "none", r"gravity.*(removed|missing|taken|without|subtracted|lack)|(without|no|lack).*gravity"),
    Fault("imu-cyclic", "The IMU's axes are y, z and x.", _both(_permuted(CYCLIC)), "axes", IMU_AXES),
    Fault("imu-left-handed", "The IMU's x and y are swapped, which makes its frame left-handed.", _both(_permuted(SWAPPED)), "axes", IMU_AXES),
    Fault("imu-of-another", "The IMU's samples are those of another flight.", _of_another, "none", OTHER),
    Fault("imu-frozen", "Half way on, the IMU repeats one sample.", _frozen, "none", r"(IMU|gyro|acceler).*(froze|stopp|repeat|constant|same|stuck|not change)"),
    Fault("imu-10hz", "The IMU sends 10 samples a second.", _slow, "none", r"\bHz\b|too (slow|few)|samples (a|per) second"),
    Fault("elevator", "A cabin moves up with the head and all it sees, and the IMU feels that.", _in_cabin, "none", rf"({_ACCEL}|IMU).*(not|dis).*(agree|fit|match|explain)|elevator|moves along|vehicle|cabin"),
)  # fmt: skip
