# SPDX-License-Identifier: MIT OR Apache-2.0
"""From a recording to the payload's transforms and latency."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import BentwingError, EstimationError, PayloadError, RecordingError
from bentwing.base.mount import MotorMount
from bentwing.base.progress import as_progress
from bentwing.calibrate.from_motion import calibrate_in_motion
from bentwing.calibrate.motor_mount import calibrate_motor, place
from bentwing.calibrate.outcome import Calibrated, with_motion, with_motor
from bentwing.calibrate.revolution import find_stretches, read_course, read_revolutions
from bentwing.calibrate.wall import best_wall
from bentwing.recording.described import described_mount
from bentwing.recording.payload import as_payload
from bentwing.recording.preprocess.part import RecordingPart
from bentwing.recording.recording import Recording

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.base.progress import Progress
    from bentwing.calibrate.motor_mount import MotorCalibration
    from bentwing.calibrate.revolution import Course, Stretch
    from bentwing.calibrate.wall import WallSection
    from bentwing.recording.payload import PayloadLike

    FromRest = tuple[MotorCalibration, tuple[Stretch, ...], WallSection]

# An angle that is known worse than this is worth a sentence, rad.
POOR = np.radians(0.02)


def calibrate(
    paths: Path | str | Sequence[Path | str],
    payload: PayloadLike,
    *,
    start: float | None = None,
    duration: float | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Calibrated:
    """Calibrate a sensor head by a recording.

    Revolutions of the motor with the carrier at rest tell where the lidar is on the motor; motion
    with an IMU tells the rest. A recording may have both.

    Parameters
    ----------
    paths : one recording, or its consecutive parts
    payload : the sensor head as it is believed to be, or the payload.yaml that describes it
    start, duration : s, the part of the recording to use; default: all of it
    threads : of the estimator in motion
    progress : shows the user how far it is; default: nothing

    Raises
    ------
    InputError, EstimationError
        The recording tells nothing; why, and how to record one that does.
    """
    head, watch = as_payload(payload), as_progress(progress)
    with Recording(paths, head) as recording:
        part = RecordingPart(recording, recording.payload, start, duration)
        return _calibrated(part, watch, threads)


def _calibrated(part: RecordingPart, progress: Progress, threads: int | None) -> Calibrated:
    with progress.stage("angles and inertial samples", part.length) as shown:
        course = read_course(part, shown)
    payload = part.payload
    warnings: list[str] = []
    rest: FromRest | None = None
    if payload.encoder is not None:
        try:
            rest = _from_rest(part, course, progress)
        except (RecordingError, EstimationError) as error:
            if not course.moves:
                raise
            warnings.append(f"no revolution at rest: {error}")
        else:
            payload = with_motor(payload, rest[0])
            warnings += _doubts(rest[0])
    elif not course.moves:
        raise PayloadError(_nothing_to_do(course))
    motion = None
    if course.moves:
        moving = replace(part, payload=payload)
        try:
            with progress.stage("motion", part.length) as shown:
                motion = calibrate_in_motion(
                    moving, shown, motor_is_known=rest is not None, threads=threads
                )
        except BentwingError as error:
            if rest is None:
                raise
            warnings.append(f"nothing from motion: {error}")
        else:
            payload = with_motion(payload, motion)
    motor, stretches, wall = rest or (None, (), None)
    return Calibrated(payload, motor, stretches, motion, wall, tuple(warnings))


def _from_rest(part: RecordingPart, course: Course, progress: Progress) -> FromRest:
    mount, sigma = described_mount(part.payload), part.payload.lidar.range_sigma
    assert isinstance(mount, MotorMount)
    stretches = find_stretches(course)
    with progress.stage("revolutions"):
        seen = read_revolutions(part, course, stretches)
        motor = calibrate_motor(seen, mount.axis, mount.T_motor_lidar, sigma)
        before, after = (
            place(seen, mount.axis, lidar, motor.delay, motor.turns)
            for lidar in (mount.T_motor_lidar, motor.T_motor_lidar)
        )
        wall = best_wall(before, after, seen.halves, sigma)
    return motor, stretches, wall


def _doubts(motor: MotorCalibration) -> list[str]:
    worst = float(motor.std[:2].max())
    if worst <= POOR:
        return []
    return [
        f"an angle of the lidar on the motor is known to {np.degrees(worst):.3f}° only: record more "
        "revolutions, or in a room with more and larger walls"
    ]


def _nothing_to_do(course: Course) -> str:
    if course.imu is None:
        return (
            "the payload describes no encoder and the recording has no IMU: there is nothing to "
            "calibrate; add the encoder section of a motor-turned lidar, or record an IMU"
        )
    return (
        "the payload describes no encoder and the carrier does not move: the mount of a fixed lidar on "
        "the IMU is seen in motion only; record half a minute with turns about all axes"
    )
