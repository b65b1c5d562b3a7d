# SPDX-License-Identifier: MIT OR Apache-2.0
"""The set-up of a 3D lidar: it is followed by itself, and the IMU compared with its motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import EstimationError
from bentwing.calibrate.set_up import axes, edits
from bentwing.calibrate.set_up.errors import DefectError, NotFoundError
from bentwing.calibrate.set_up.explain import explain
from bentwing.calibrate.set_up.hand_eye import fit_accel, fit_gyro
from bentwing.calibrate.set_up.motion import lidar_motion
from bentwing.recording.readings import GYRO_FACTORS
from bentwing.recording.sections.imu import Imu

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.explain import Explanation
    from bentwing.calibrate.set_up.hand_eye import AccelFit, GyroFit
    from bentwing.calibrate.set_up.motion import LidarMotion
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.recording import ImuBatch, Payload

# The rates of two sensors that are one head agree to 0.97 and better.
LEAST_CORRELATION = 0.9
# Where both hands explain the rates, the better one must leave so much less.
HAND_IS_CLEAR = 0.7
# Axes other than the gyro's must explain the forces so much better.
AXES_ARE_CLEAR = 0.7
# rad; a described rotation that is farther off is replaced, a better one the estimator corrects.
AS_DESCRIBED = np.radians(5.0)


def describe_by_motion(
    stretch: Stretch, payload: Payload, imu_topic: str, *, has_mount: bool, threads: int | None
) -> list[Payload]:
    """Return the payload with unit, axes, latency and rotation as the lidar's motion shows them.

    Where it hardly shows the axes of the accelerometer, those of the gyro come first.

    Parameters
    ----------
    stretch : as drivers give it
    payload : that says nothing of axes and latency; whose encoder is right, if it has one
    has_mount : whether it describes the mount

    Raises
    ------
    NotFoundError
        The lidar cannot be followed, or the IMU does not follow it.
    """
    read = stretch.read_as(payload)
    motion = followed(read, payload, threads)
    gyro = fit_gyro(motion, read.imu)
    if gyro.correlation < LEAST_CORRELATION:
        raise NotFoundError(_unlike(imu_topic, gyro))
    found = edits.with_latency(_scaled(payload, gyro, imu_topic), gyro.delay)
    described = edits.described_rotation(payload) if has_mount else None
    likely, others = [], []
    for M in _hands(gyro):
        first, *more = _accel_axes(motion, read.imu, gyro.delay, M)
        likely.append(explain(M, first.C, described))
        others += [explain(M, fit.C, described) for fit in more]
    best = [min(e, key=lambda e: e.cost) for e in map(_known, (likely, others)) if e]
    if not best:
        raise NotFoundError(_no_axes(imu_topic))
    return [_read_as(found, explanation, described) for explanation in best]


def _known(explained: Iterable[Explanation | None]) -> list[Explanation]:
    return [explanation for explanation in explained if explanation is not None]


def _read_as(
    payload: Payload, explanation: Explanation, described: NDArray[np.float64] | None
) -> Payload:
    """Return the payload with axes and mount as an explanation has them."""
    found = edits.with_axes(payload, explanation.gyro_axes, explanation.accel_axes)
    found = edits.with_lidar(found, mirrored=payload.lidar.mirrored ^ explanation.mirrored)
    R = explanation.R_imu_lidar
    if described is not None and axes.angle_between(R, described) <= AS_DESCRIBED:
        return found
    return edits.with_rotation(found, R)


def followed(stretch: Stretch, payload: Payload, threads: int | None) -> LidarMotion:
    """Follow the lidar without the IMU.

    Raises
    ------
    NotFoundError
        Its scans do not fit together.
    """
    try:
        motion = lidar_motion(stretch.without_imu, payload, threads)
    except EstimationError as error:
        msg = f"the lidar cannot be followed by itself ({error})"
        raise NotFoundError(msg) from error
    shares = [w.inlier_share for w in motion.windows[len(motion.windows) // 4 :] if w.inlier_share]
    if not shares or float(np.median(shares)) < LEAST_CORRELATION:
        msg = (
            "consecutive scans of the lidar do not fit together by themselves: check its ranges, the "
            "times of its points and that it saw walls or ground within its reach"
        )
        raise NotFoundError(msg)
    return motion


def _hands(gyro: GyroFit) -> Iterator[NDArray[np.float64]]:
    yield gyro.M
    if gyro.left > HAND_IS_CLEAR * gyro.mirrored_left:
        yield gyro.mirrored_M


def _accel_axes(
    motion: LidarMotion, imu: ImuBatch, delay: float, M: NDArray[np.float64]
) -> list[AccelFit]:
    """Return the fit of the accelerometer by the axes of the gyro, and by others that are better.

    Where these are clearly better, by these alone.
    """
    fits = [fit_accel(motion, imu, delay, P @ M) for P in axes.signed_permutations()]
    # Turned about, forces fit as well, but to accelerations the other way.
    fits = [fit for fit in fits if fit.slope > 0.0] or fits
    plain = next((fit for fit in fits if np.array_equal(fit.C, M)), None)
    best = min(fits, key=lambda fit: fit.left)
    if plain is None or best.left < AXES_ARE_CLEAR * plain.left:
        return [best]
    return [plain] if best is plain else [plain, best]


def _scaled(payload: Payload, gyro: GyroFit, imu_topic: str) -> Payload:
    """Return the payload with the unit of the gyro."""
    imu = payload.imu or Imu()
    unit = edits.unit_of_gyro(gyro.scale / GYRO_FACTORS[imu.units.gyro])
    if unit is None:
        msg = (
            f"{imu_topic}: the gyro shows {gyro.scale:.2f} times the turn that the lidar sees; "
            "correct its scale in the driver"
        )
        raise DefectError(msg)
    if unit == imu.units.gyro:
        return payload
    return edits.with_imu(payload, units=imu.units.model_copy(update={"gyro": unit}))


def _unlike(imu_topic: str, gyro: GyroFit) -> str:
    return (
        f"{imu_topic}: the gyro does not turn as the lidar does (correlation "
        f"{gyro.correlation:.2f} at best, in any mount and with any delay up to 5 s; 0.97 and more is "
        "usual): check that the IMU is on the lidar's head, works, and was recorded with it"
    )


def _no_axes(imu_topic: str) -> str:
    return (
        f"{imu_topic}: gyro and accelerometer do not fit one mount of the lidar on any axes; check "
        "the axes of both in the driver"
    )
