# SPDX-License-Identifier: MIT OR Apache-2.0
"""IMUs whose axes, units and scales are not those of a set-up as it should be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.faults.fault import Changes, Fault, Subject
from bentwing.simulate.faults.messages import accel, gyro, set_accel, set_gyro

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.faults.fault import Edit, Message

    Array = NDArray[np.float64]
    Function = Callable[[Array], Array]
    Change = Callable[[Subject], Changes]

GRAVITY = 9.80665
SWAPPED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
CYCLIC = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
SATURATED = 0.4
"""Share of its largest rate at which the gyro is clipped."""

GYRO, ACCEL = r"gyro|angular rate", r"acceler"
_AXES = r"ax[ie]s|mirror|sign|handed|swap|permute|direction"
_GYRO_AXES = rf"({GYRO}).*({_AXES})|({_AXES}).*({GYRO})"
_ACCEL_AXES = rf"({ACCEL}).*({_AXES})|({_AXES}).*({ACCEL})"
_IMU_AXES = rf"(IMU|{GYRO}|{ACCEL}).*({_AXES})|({_AXES}).*IMU|mount|T_imu_lidar"
_SAME = rf"({GYRO}).*(zero|constant|same|still|stuck|dead|not (turn|change))"
_SCALE = rf"({GYRO}).*(scale|unit|factor|times|%)|otherwise than the gyro"


def changed(on_gyro: Function | None = None, on_accel: Function | None = None) -> Edit:
    """Return what changes the rates and the accelerations of every sample."""

    def edit(message: Message) -> Message:
        if on_gyro is not None:
            set_gyro(message, on_gyro(gyro(message)))
        if on_accel is not None:
            set_accel(message, on_accel(accel(message)))
        return message

    return edit


def _gyro(function: Function) -> Change:
    return lambda _: Changes(imu=changed(on_gyro=function))


def _accel(function: Function) -> Change:
    return lambda _: Changes(imu=changed(on_accel=function))


def _both(function: Function) -> Change:
    return lambda _: Changes(imu=changed(function, function))


def _one_negated(make: Callable[[Function], Change]) -> Change:
    """Negate an axis that is drawn."""

    def change(subject: Subject) -> Changes:
        signs = np.where(np.arange(3) == subject.rng.integers(3), -1.0, 1.0)
        return make(lambda vector: signs * vector)(subject)

    return change


def _constant(subject: Subject) -> Changes:
    first = gyro(next(subject.imu()))
    return Changes(imu=changed(on_gyro=lambda _: first))


def _saturated(subject: Subject) -> Changes:
    limit = SATURATED * max(float(np.abs(gyro(message)).max()) for message in subject.imu())
    return Changes(imu=changed(on_gyro=lambda rates: rates.clip(-limit, limit)))


def _swapped(vector: Array) -> Array:
    return SWAPPED @ vector


def _cyclic(vector: Array) -> Array:
    return CYCLIC @ vector


FAULTS = (
    Fault(
        "gyro-swapped",
        "The gyro's x and y are swapped.",
        _gyro(_swapped),
        "axes",
        _GYRO_AXES,
    ),
    Fault(
        "gyro-cyclic",
        "The gyro's axes are y, z and x.",
        _gyro(_cyclic),
        "axes",
        _GYRO_AXES,
    ),
    Fault(
        "gyro-one-negated",
        "One axis of the gyro is negated.",
        _one_negated(_gyro),
        "axes",
        _GYRO_AXES,
    ),
    Fault(
        "gyro-negated",
        "All axes of the gyro are negated.",
        _gyro(np.negative),
        "axes",
        _GYRO_AXES,
    ),
    Fault(
        "gyro-zero",
        "The gyro reads zero.",
        _gyro(np.zeros_like),
        "none",
        _SAME,
    ),
    Fault(
        "gyro-constant",
        "The gyro always reads the same.",
        _constant,
        "none",
        _SAME,
    ),
    Fault(
        "gyro-saturated",
        "The gyro is clipped at two fifths of its largest rate.",
        _saturated,
        "none",
        rf"({GYRO}).*(saturat|clip|full scale|limit|range)",
    ),
    Fault(
        "gyro-1.2",
        "The gyro reads 1.2 times too much.",
        _gyro(lambda rates: 1.2 * rates),
        "none",
        _SCALE,
    ),
    Fault(
        "gyro-2",
        "The gyro reads twice too much.",
        _gyro(lambda rates: 2.0 * rates),
        "none",
        _SCALE,
    ),
    Fault(
        "gyro-degrees",
        "The gyro is in deg/s.",
        _gyro(np.degrees),
        "units",
        rf"({GYRO}).*(deg|°)",
    ),
    Fault(
        "accel-swapped",
        "The accelerometer's x and y are swapped.",
        _accel(_swapped),
        "axes",
        _ACCEL_AXES,
    ),
    Fault(
        "accel-cyclic",
        "The accelerometer's axes are y, z and x.",
        _accel(_cyclic),
        "axes",
        _ACCEL_AXES,
    ),
    Fault(
        "accel-one-negated",
        "One axis of the accelerometer is negated.",
        _one_negated(_accel),
        "axes",
        _ACCEL_AXES,
    ),
    Fault(
        "accel-negated",
        "All axes of the accelerometer are negated.",
        _accel(np.negative),
        "axes",
        _ACCEL_AXES,
    ),
    Fault(
        "accel-g",
        "The accelerations are in g.",
        _accel(lambda force: force / GRAVITY),
        "units",
        rf"({ACCEL}).* g\b",
    ),
    Fault(
        "accel-milli-g",
        "The accelerations are in milli-g.",
        _accel(lambda force: 1e3 * force / GRAVITY),
        "units",
        rf"({ACCEL}).*(milli-g|mg)",
    ),
    Fault(
        "imu-cyclic",
        "The IMU's axes are y, z and x.",
        _both(_cyclic),
        "axes",
        _IMU_AXES,
    ),
    Fault(
        "imu-left-handed",
        "The IMU's x and y are swapped, which makes its frame left-handed.",
        _both(_swapped),
        "axes",
        _IMU_AXES,
    ),
)
