# SPDX-License-Identifier: MIT OR Apache-2.0
"""Clocks that do not agree: the IMU has one, the lidar (and the encoder beside it) another."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from bentwing.simulate.faults.fault import Changes, Fault, Subject
from bentwing.simulate.faults.messages import NS_PER_S, set_stamp, stamp_ns

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.simulate.faults.fault import Edit, Message, Repair
    from bentwing.simulate.names import FaultName

CAUSE = r"clock|latency|stamp|\b(late|early)\b|delay"
FITTED = 1.0
"""s, up to which the clocks can be fitted to each other."""
SINCE_POWER_ON = 47 * NS_PER_S
"""ns, age of a sensor when the recording starts."""
DRIFT = 0.01


def _restamped(new: Callable[[int], int]) -> Edit:
    def edit(message: Message) -> Message:
        set_stamp(message, new(stamp_ns(message)))
        return message

    return edit


def _late(seconds: float) -> Callable[[Subject], Changes]:
    shift = round(seconds * NS_PER_S)
    edit = _restamped(lambda stamp: stamp + shift)
    return lambda _: Changes(lidar=edit, encoder=edit)


def _lidar_from_power_on(subject: Subject) -> Changes:
    origin = subject.reader.start_time - SINCE_POWER_ON
    edit = _restamped(lambda stamp: stamp - origin)
    return Changes(lidar=edit, encoder=edit)


def _imu_from_power_on(subject: Subject) -> Changes:
    origin = subject.reader.start_time - SINCE_POWER_ON
    return Changes(imu=_restamped(lambda stamp: stamp - origin))


def _drifting(subject: Subject) -> Changes:
    origin = subject.reader.start_time
    edit = _restamped(lambda stamp: stamp + round(DRIFT * (stamp - origin)))
    return Changes(lidar=edit, encoder=edit)


def _off(seconds: float, way: str, sign: float) -> Fault:
    repair: Repair = "latency" if seconds <= FITTED else "none"
    return Fault(
        cast("FaultName", f"lidar-{way}-{seconds:g}"),
        f"The stamps of the lidar, and of its encoder, are {seconds:g} s too {way}.",
        _late(sign * seconds),
        repair,
        CAUSE,
    )


FAULTS = (
    *(
        _off(seconds, way, sign)
        for seconds in (0.05, 0.5, 1.0, 3.0)
        for way, sign in (("late", 1.0), ("early", -1.0))
    ),
    Fault(
        "lidar-power-on",
        "The stamps of the lidar, and of its encoder, count from when it was switched on.",
        _lidar_from_power_on,
        "latency",
        CAUSE,
    ),
    Fault(
        "imu-power-on",
        "The stamps of the IMU count from when it was switched on.",
        _imu_from_power_on,
        "latency",
        CAUSE,
    ),
    Fault(
        "lidar-drifting",
        "The clock of the lidar, and of its encoder, is fast by 1 %.",
        _drifting,
        "none",
        rf"drift|{CAUSE}",
    ),
)
