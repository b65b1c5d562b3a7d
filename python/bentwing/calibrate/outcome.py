# SPDX-License-Identifier: MIT OR Apache-2.0
"""From what was found to a payload.yaml with standard deviations, and a record."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.mount import FixedMount
from bentwing.calibrate.motor_mount import OFFSET_PRIOR
from bentwing.recording.sections.calibration import CalibrationRecord
from bentwing.recording.sections.ranges import Ranges
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Pose
    from bentwing.calibrate.motor_mount import MotorCalibration
    from bentwing.calibrate.revolution import Stretch
    from bentwing.calibrate.wall import WallSection
    from bentwing.recording import Payload

# A shift is observable if the recording made it so much more certain than it was assumed to be, and the
# delay if it is known so well, s: less would help no estimator.
GAIN, SEEN_DELAY = 0.5, 5e-4
# Digits that are written: far below what can be known.
DIGITS = 9
FREE = (
    "the turn of the lidar about the motor's axis and its shift along it: they move all points alike "
    "and are kept as the payload has them"
)
ONE_RATE = (
    "the delay of the encoder against the lidar: at one rate it is a turn about the axis; record one "
    "revolution in each direction, or at two rates"
)
NO_MOTION = (
    "the mount of the IMU and the lidar's latency against it: at rest nothing shows them; record "
    "half a minute of motion with turns about all axes"
)


@dataclass(frozen=True, slots=True)
class Calibrated:
    """What a recording tells of the sensor head.

    Attributes
    ----------
    payload : with all that was found, and its standard deviations
    motor : from revolutions at rest; None without
    stretches : the revolutions
    motion : from motion; None without
    wall : one wall before and after; None without revolutions at rest
    warnings : sentences
    """

    payload: Payload
    motor: MotorCalibration | None
    stretches: tuple[Stretch, ...]
    motion: Calibration | None
    wall: WallSection | None
    warnings: tuple[str, ...]

    @property
    def record(self) -> CalibrationRecord:
        """Standard deviations, and what is not observable."""
        return self.payload.calibration or CalibrationRecord()


def with_motor(payload: Payload, motor: MotorCalibration) -> Payload:
    """Return the payload with the lidar's place on the motor, and the delay where it was seen."""
    assert payload.encoder is not None
    delay_seen = motor.std[4] < SEEN_DELAY
    std = {"motor_tilt": _rounded(motor.std[:2]), "motor_offset": _rounded(motor.std[2:4])}
    unseen = [FREE]
    if delay_seen:
        std["encoder_delay"] = _rounded(motor.std[4:])
    else:
        unseen.append(ONE_RATE)
    for direction, sigma in zip(motor.across, motor.std[2:4], strict=True):
        if sigma > GAIN * OFFSET_PRIOR:
            named = ", ".join(f"{c:.2f}" for c in direction)
            unseen.append(
                f"the shift of the lidar along ({named}) in the motor's frame: no wall faces it"
            )
    delay = payload.encoder.delay + (motor.delay if delay_seen else 0.0)
    encoder = payload.encoder.model_copy(
        update={"T_motor_lidar": _transform(motor.T_motor_lidar), "delay": round(delay, DIGITS)}
    )
    first, second = (tuple(float(round(c, DIGITS)) for c in row) for row in motor.across)
    known = CalibrationRecord(
        std=std, motor_across=(first, second), not_observable=(*unseen, NO_MOTION)
    )
    return payload.model_copy(update={"encoder": encoder, "calibration": known})


def with_motion(payload: Payload, found: Calibration) -> Payload:
    """Return the payload with what motion has told; without an IMU that is nothing."""
    if "latency" not in found.std:
        return payload
    known = payload.calibration or CalibrationRecord()
    names = [
        "latency",
        "extrinsic_rotation",
        "extrinsic_translation",
        "range_offset",
        "range_grazing",
    ]
    lidar: dict[str, Any] = {"latency": round(found.source_latency, DIGITS)}
    if found.std.keys() & {"range_offset", "range_grazing"}:
        bias = found.ranges
        lidar["ranges"] = Ranges(
            offset=round(bias.offset, DIGITS), grazing=round(bias.grazing, DIGITS)
        )
    update: dict[str, Any] = {"lidar": payload.lidar.model_copy(update=lidar)}
    mount = found.mount
    if isinstance(mount, FixedMount):
        update["T_imu_lidar"] = _transform(mount.T_imu_lidar)
    else:
        assert payload.encoder is not None
        update["encoder"] = payload.encoder.model_copy(
            update={
                "T_imu_motor": _transform(mount.T_imu_motor),
                "zero": round(mount.encoder_zero, DIGITS),
                "T_motor_lidar": _transform(mount.T_motor_lidar),
                "eccentricity": _rounded(mount.errors.eccentricity),
                "wobble": tuple(_rounded(row) for row in mount.errors.wobble),
            }
        )
        names += [n for n in ("motor_tilt", "motor_offset") if n not in known.std]
        names += ["encoder_zero", "encoder_eccentricity", "motor_wobble"]
    std = {**known.std, **{n: _rounded(found.std[n]) for n in names if n in found.std}}
    unseen = tuple(s for s in known.not_observable if s != NO_MOTION)
    update["calibration"] = known.model_copy(update={"std": std, "not_observable": unseen})
    return payload.model_copy(update=update)


def as_record(found: Calibrated) -> dict[str, Any]:
    """Return what calibration.json says, in SI units and radians."""
    record: dict[str, Any] = {
        "payload": found.payload.model_dump(mode="json", exclude_defaults=True),
        "std": found.record.std,
        "not_observable": found.record.not_observable,
        "warnings": found.warnings,
        "motor": None,
        "motion": None,
    }
    if found.motor is not None:
        record["motor"] = {
            "stretches": found.stretches,
            "T_motor_lidar": found.motor.T_motor_lidar,
            "across": found.motor.across,
            "delay": found.motor.delay,
            "correction": found.motor.correction,
            "covariance": found.motor.covariance,
            "n_pairs": found.motor.n_pairs,
            "n_points": found.motor.n_points,
            "residual_rms_before": found.motor.residual_rms[0],
            "residual_rms_after": found.motor.residual_rms[1],
            "wall_gap_before": None if found.wall is None else found.wall.gaps[0],
            "wall_gap_after": None if found.wall is None else found.wall.gaps[1],
        }
    if found.motion is not None:
        record["motion"] = found.motion
    return record


def _transform(pose: Pose) -> Transform:
    x, y, z = (round(float(v), DIGITS) for v in pose.translation)
    # A quaternion that is rounded is renormalized on entry.
    a, b, c, d = (round(float(v), 12) for v in pose.quaternion)
    return Transform(translation=(x, y, z), quaternion=(a, b, c, d))


def _rounded(values: Any) -> tuple[float, ...]:  # noqa: ANN401 - arrays and lists
    return tuple(float(f"{v:.3g}") for v in np.ravel(values))
