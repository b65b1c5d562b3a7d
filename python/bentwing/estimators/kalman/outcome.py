# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the passes of the filter say, as an `Estimate`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import geometry
from bentwing.estimators.interface import Calibration, Estimate
from bentwing.estimators.kalman.core import (
    ACCEL_BIAS,
    BASE_ROTATION,
    BASE_TRANSLATION,
    DT,
    ENCODER_DELAY,
    GRAVITY,
    GYRO_BIAS,
    LATENCY,
    LIDAR_ROTATION,
    LIDAR_TRANSLATION,
)
from bentwing.estimators.mount import FixedMount, MotorMount, Mount, Pose
from bentwing.estimators.segments import joined
from bentwing.estimators.start import STANDARD_GRAVITY, levelling
from bentwing.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.estimators.kalman.filter_pass import FilterPass

# More of the sweeps than this are worth a sentence.
FEW = 0.02
# So long a weakness is, s: a lidar that turns looks elsewhere before.
WEAK = 3.0
# Seconds without inertial samples that are.
BLIND = 0.3


def estimate_of(
    passes: Sequence[FilterPass], mount: Mount, notes: list[str], n_small: int
) -> Estimate:
    """Return what passes that follow each other say, level and from the origin on.

    Parameters
    ----------
    passes : between two of them the recording breaks
    mount : as the filter takes it
    notes : sentences to add to the warnings
    n_small : sweeps with too few points
    """
    last = passes[-1]
    turn = levelling(np.array(last.filter.gravity))
    parts = [levelled(p.trajectory(), turn) for p in passes if p.windows]
    windows = [w for p in passes for w in p.windows]
    blind = sum(p.blind for p in passes)
    return Estimate(
        joined(parts, DT),
        calibration_of(last, mount),
        windows=windows,
        counts={
            "kalman.sweeps": len(windows),
            "kalman.sweeps_not_matched": sum(not w["registered"] for w in windows),
            "kalman.sweeps_too_small": n_small,
        },
        timings={"filter": sum(p.seconds for p in passes)},
        warnings=_warnings(windows, blind) + notes,
        segments=[(float(p.times[0]), float(p.times[-1])) for p in parts],
    )


def levelled(trajectory: Trajectory, turn: NDArray[np.float64]) -> Trajectory:
    """Return the poses turned about the origin by a rotation (4,)."""
    return Trajectory(
        trajectory.times,
        geometry.rotate(turn, trajectory.positions),
        geometry.multiply(turn, trajectory.quats_xyzw),
    )


def calibration_of(done: FilterPass, mount: Mount) -> Calibration:
    """Return the slow states with their standard deviations."""
    filter_ = done.filter
    std = np.sqrt(np.maximum(np.diag(filter_.covariance), 0.0))
    named = {
        "latency": std[LATENCY],
        "extrinsic_rotation": std[BASE_ROTATION],
        "extrinsic_translation": std[BASE_TRANSLATION],
        "gyro_bias": std[GYRO_BIAS],
        "accel_bias": std[ACCEL_BIAS],
        "gravity": std[GRAVITY],
    }
    found: Mount = FixedMount(_pose(filter_.base))
    if isinstance(mount, MotorMount):
        # A delay of the encoder is a zero at the rate at which the motor turns.
        zero = mount.encoder_zero - done.motor_rate * filter_.encoder_delay
        found = MotorMount(_pose(filter_.base), mount.axis, zero, _pose(filter_.lidar))
        covariance = filter_.covariance
        named["encoder_zero"] = abs(done.motor_rate) * std[ENCODER_DELAY]
        named["motor_tilt"] = _across(covariance[LIDAR_ROTATION, LIDAR_ROTATION], mount.axis)
        named["motor_offset"] = _across(
            covariance[LIDAR_TRANSLATION, LIDAR_TRANSLATION], mount.axis
        )
    return Calibration(
        latency=filter_.latency,
        mount=found,
        gyro_bias=np.array(filter_.gyro_bias),
        accel_bias=np.array(filter_.accel_bias),
        gravity=np.array([0.0, 0.0, STANDARD_GRAVITY]),
        std={name: values.tolist() for name, values in named.items()},
    )


def _across(covariance: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviations (2,) across the motor's axis."""
    pair = np.linalg.svd(axis[None])[2][1:]
    return np.asarray(np.sqrt(np.maximum(np.diag(pair @ covariance @ pair.T), 0.0)))


def _pose(transform: tuple[list[float], list[float]]) -> Pose:
    translation, quat = transform
    return Pose(np.array(translation), np.array(quat))


def _warnings(windows: list[dict[str, Any]], blind: float) -> list[str]:
    sentences = []
    # The first sweep makes the map.
    lost = [w["time"] for w in windows[1:] if not w["registered"]]
    if len(lost) > FEW * len(windows):
        sentences.append(
            f"{len(lost)} of {len(windows)} sweeps match too little of what was seen before (first "
            f"at {lost[0]:.1f} s): the IMU alone carries the estimate there"
        )
    start, stop = _longest_weakness(windows)
    if stop - start > WEAK:
        sentences.append(
            f"from {start:.1f} to {stop:.1f} s the sweeps see too little in some direction: the IMU "
            "carries the estimate there"
        )
    if blind > BLIND:
        sentences.append(f"{blind:.2f} s have no inertial data: the motion went on as before there")
    return sentences


def _longest_weakness(windows: list[dict[str, Any]]) -> tuple[float, float]:
    """Return first and last time of the longest stretch of degenerate sweeps."""
    longest, since = (0.0, 0.0), None
    for w in windows:
        if not (w["registered"] and w["degenerate"]):
            since = None
            continue
        since = w["time"] if since is None else since
        if w["time"] - since > longest[1] - longest[0]:
            longest = since, w["time"]
    return longest
