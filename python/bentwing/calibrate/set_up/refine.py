# SPDX-License-Identifier: MIT OR Apache-2.0
"""Refine a set-up that was found by what is seen with it, and test that it holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.mount import FixedMount
from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.planar import richest
from bentwing.calibrate.set_up.spatial import NotFoundError
from bentwing.calibrate.set_up.trial import try_payload
from bentwing.recording.sections.imu import Imu
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Pose
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.calibrate.set_up.trial import Trial
    from bentwing.recording import Payload

# Standard deviations of what was found before: s, rad; and of a shift that nothing has told yet, m.
FOUND_LATENCY, FOUND_ROTATION, UNKNOWN_SHIFT = 0.005, 0.03, 0.15
REFINED = 12.0  # s
CAUTION = 2.0  # what a short stretch says of a mount is less certain than it seems


def refined(stretch: Stretch, payload: Payload, *, has_mount: bool, threads: int | None) -> Payload:
    """Return the payload with latency and mount as the estimator finds them, starting from it.

    Raises
    ------
    NotFoundError
        What is seen does not fit together with it.
    """
    wide = edits.with_std(payload, latency=FOUND_LATENCY, extrinsic_rotation=FOUND_ROTATION)
    if not has_mount:
        wide = edits.with_std(wide, extrinsic_translation=UNKNOWN_SHIFT)
    read = stretch.read_as(wide)
    trial = try_payload(read.part(*richest(read.imu, REFINED)), wide, threads)
    if not trial.is_consistent or trial.calibration is None:
        raise NotFoundError(trial.sentence)
    mount = trial.calibration.mount
    found = edits.with_latency(payload, trial.calibration.source_latency)
    if not has_mount:
        # What little was seen leaves of it is still to be found.
        found = _with_noise(edits.with_std(found, **_std(trial.calibration)), trial)
    if isinstance(mount, FixedMount):
        return found.model_copy(update={"T_imu_lidar": _transform(mount.T_imu_lidar)})
    return edits.with_encoder(
        found, T_imu_motor=_transform(mount.T_imu_motor), zero=mount.encoder_zero
    )


def _with_noise(payload: Payload, trial: Trial) -> Payload:
    """Return the payload with as much noise of the IMU as its residuals show, where that is more."""
    imu, last = payload.imu or Imu(), trial.last
    assert last is not None
    gyro, accel = max(1.0, last.gyro_rms or 1.0), max(1.0, last.accel_rms or 1.0)
    if gyro == accel == 1.0:
        return payload
    return edits.with_imu(
        payload, gyro_noise=imu.gyro_noise * gyro, accel_noise=imu.accel_noise * accel
    )


def _std(found: Calibration) -> dict[str, float]:
    names = ("extrinsic_rotation", "extrinsic_translation")
    return {name: CAUTION * max(found.std[name]) for name in names}


def _transform(pose: Pose) -> Transform:
    return Transform(
        translation=tuple(float(x) for x in pose.translation),
        quaternion=tuple(float(x) for x in pose.quaternion),
    )
