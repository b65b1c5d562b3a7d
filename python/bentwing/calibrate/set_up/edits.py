# SPDX-License-Identifier: MIT OR Apache-2.0
"""Payloads with one thing described differently."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import FixedMount
from bentwing.calibrate.set_up import axes
from bentwing.recording.readings import GYRO_FACTORS
from bentwing.recording.sections.calibration import CalibrationRecord
from bentwing.recording.sections.imu import AS_GIVEN, Imu, ImuUnits
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.mount import MotorMount, Pose
    from bentwing.recording import Payload
    from bentwing.recording.sections.imu import GyroUnit

AS_GOOD_AS_ONE = 0.1
LARGEST_LATENCY = 1.5  # s that a payload can describe; more goes into the clock's offset


def as_given(payload: Payload) -> Payload:
    """Return the payload that reads the samples of lidar and IMU as drivers give them."""
    imu = payload.imu
    if imu is not None and (imu.axes, imu.gyro_axes, imu.units) != (AS_GIVEN, None, ImuUnits()):
        payload = with_imu(payload, axes=AS_GIVEN, gyro_axes=None, units=ImuUnits())
    return with_lidar(payload, latency=0.0, mirrored=False, range_scale=1.0)


def with_lidar(payload: Payload, **changes: Any) -> Payload:  # noqa: ANN401 - any field
    """Return the payload with other values for its lidar."""
    return payload.model_copy(update={"lidar": payload.lidar.model_copy(update=changes)})


def with_imu(payload: Payload, **changes: Any) -> Payload:  # noqa: ANN401 - any field
    """Return the payload with other values for its IMU."""
    return payload.model_copy(update={"imu": (payload.imu or Imu()).model_copy(update=changes)})


def with_encoder(payload: Payload, **changes: Any) -> Payload:  # noqa: ANN401 - any field
    """Return the payload with other values for its encoder."""
    assert payload.encoder is not None
    return payload.model_copy(update={"encoder": payload.encoder.model_copy(update=changes)})


def with_axes(payload: Payload, gyro: NDArray[np.float64], accel: NDArray[np.float64]) -> Payload:
    """Return the payload with axes (3, 3) of the IMU."""
    own = None if np.array_equal(gyro, accel) else axes.named(gyro)
    imu = payload.imu or Imu()
    if (imu.axes, imu.gyro_axes) == (axes.named(accel), own):
        return payload
    return with_imu(payload, axes=axes.named(accel), gyro_axes=own)


def axes_of(imu: Imu) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the axes (3, 3) of gyro and accelerometer."""
    return axes.of(imu.gyro_axes or imu.axes), axes.of(imu.axes)


def with_latency(payload: Payload, latency: float) -> Payload:
    """Return the payload with a latency, s; of clocks that are not one it goes to the IMU's."""
    offset = 0.0 if payload.imu is None else payload.imu.clock_offset
    if offset == 0.0 and abs(latency) <= LARGEST_LATENCY:
        return with_lidar(payload, latency=round(latency, 6))
    return with_imu(with_lidar(payload, latency=0.0), clock_offset=round(offset + latency, 6))


def with_rotation(payload: Payload, R: NDArray[np.float64]) -> Payload:
    """Return the payload with another rotation (3, 3) of the lidar, or of its motor, in the IMU."""
    quat = geometry.from_matrices(R[None]).reshape(4)
    return _placed(payload, quaternion=tuple(float(x) for x in quat))


def with_shift(payload: Payload, shift: NDArray[np.float64]) -> Payload:
    """Return the payload with another shift (3,), m, of the lidar, or of its motor, in the IMU."""
    return _placed(payload, translation=tuple(float(x) for x in shift))


def with_mount(payload: Payload, mount: FixedMount | MotorMount) -> Payload:
    """Return the payload with another pose of the lidar, or of its motor and of it on that."""
    if isinstance(mount, FixedMount):
        return payload.model_copy(update={"T_imu_lidar": _transform(mount.T_imu_lidar)})
    return with_encoder(
        payload,
        T_imu_motor=_transform(mount.T_imu_motor),
        T_motor_lidar=_transform(mount.T_motor_lidar),
        zero=mount.encoder_zero,
        **errors_of(mount),
    )


def errors_of(mount: MotorMount) -> dict[str, Any]:
    """Return how a motor turns otherwise than its encoder reads, as fields of `encoder`."""
    eccentricity, wobble = mount.errors.eccentricity.tolist(), mount.errors.wobble.tolist()
    return {"eccentricity": tuple(eccentricity), "wobble": tuple(map(tuple, wobble))}


def _transform(pose: Pose) -> Transform:
    return Transform(
        translation=tuple(float(x) for x in pose.translation),
        quaternion=tuple(float(x) for x in pose.quaternion),
    )


def _placed(payload: Payload, **changes: tuple[float, ...]) -> Payload:
    if payload.encoder is not None:
        return with_encoder(
            payload, T_imu_motor=payload.encoder.T_imu_motor.model_copy(update=changes)
        )
    before = payload.T_imu_lidar or Transform()
    return payload.model_copy(update={"T_imu_lidar": before.model_copy(update=changes)})


def with_std(payload: Payload, **std: float) -> Payload:
    """Return the payload with standard deviations of what it says of lidar and mount."""
    known = payload.calibration or CalibrationRecord()
    sizes = {"latency": 1, "motor_tilt": 2, "motor_offset": 2}
    named = {name: (value,) * sizes.get(name, 3) for name, value in std.items()}
    return payload.model_copy(
        update={"calibration": known.model_copy(update={"std": known.std | named})}
    )


def described_rotation(payload: Payload) -> NDArray[np.float64] | None:
    """Return the rotation (3, 3) of the lidar, or of its motor, in the IMU; None if not described."""
    if payload.encoder is not None:
        return payload.encoder.T_imu_motor.pose.R
    return None if payload.T_imu_lidar is None else payload.T_imu_lidar.pose.R


def unit_of_gyro(scale: float) -> GyroUnit | None:
    """Return the unit in which a gyro of this scale gives its rates, None if it is none."""
    units = [
        unit for unit, factor in GYRO_FACTORS.items() if abs(scale * factor - 1.0) < AS_GOOD_AS_ONE
    ]
    return units[0] if units else None
