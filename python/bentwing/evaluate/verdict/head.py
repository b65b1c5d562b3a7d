# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the sensor head is what the payload describes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import FixedMount, MotorMount
from bentwing.base.trajectory import DT
from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.odometry.continuous.slow_states import initial_std
from bentwing.recording.described import described_calibration
from bentwing.recording.sections.imu import Imu

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Pose
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.recording.payload import Payload

    Array = NDArray[np.float64]

_STATES = {
    "latency": "the delay of the lidar's clock",
    "extrinsic_rotation": "the direction of the lidar or its motor on the IMU",
    "extrinsic_translation": "the place of the lidar or its motor on the IMU",
    "gyro_bias": "the gyro's zero",
    "accel_bias": "the accelerometer's zero",
    "gyro_scale": "the scale of the gyro",
    "accel_scale": "the scale of the accelerometer",
    "encoder_zero": "the encoder's zero",
    "motor_tilt": "the direction of the lidar on the motor",
    "motor_offset": "the place of the lidar on the motor",
    "encoder_eccentricity": "how far off its axis the encoder's disc is",
    "motor_wobble": "how much the motor's shaft wobbles",
}
# A drift of clocks and the turning of a plane are judged over at least so long, s.
_SHORTEST = 10.0
# So far from its first pose a carrier moves, m, and about that in rad.
_AWAY = 0.1


def judge_calibration(found: Calibration, payload: Payload) -> list[Evidence]:
    """Compare latency, mount, biases and scales with what the payload says, in its deviations."""
    # Nothing is known of biases before: a rest tells more, but the payload says nothing of them.
    stated = {} if payload.calibration is None else payload.calibration.std
    usual = initial_std(moving=True, stated=stated)
    usual |= (payload.imu or Imu()).errors_expected
    far = {
        name: np.abs(off) / usual[name]
        for name, off in _offsets(found, described_calibration(payload)).items()
        if name in found.std
    }
    if not far:
        return []
    worst = max(far, key=lambda name: float(far[name].max()))
    return [Evidence("calibration", float(far[worst].max()), (), {"name": _STATES[worst]})]


def judge_clocks(windows: Sequence[WindowRecord]) -> list[Evidence]:
    """Judge by how fast the latency changes, in a straight line, seconds a second.

    It is the whole latency at the time of each window: what the rate of the lidar's clock makes of it
    and what its walk adds. The estimator follows clocks as far apart as crystals are; that is no
    fault. Where they are further apart the stamps are wrong, however well the map fits.
    """
    known = [(w.time, w.latency) for w in windows if w.latency is not None]
    if len(known) < 4 or known[-1][0] - known[0][0] < _SHORTEST:
        return []
    times, latencies = np.array(known[len(known) // 3 :]).T
    slope = abs(float(np.polyfit(times, latencies, 1)[0]))
    return [Evidence("clocks", slope, (), {"milliseconds": 1e3 * slope})]


def judge_slice(trajectory: Trajectory, found: Calibration, normal: Array | None) -> list[Evidence]:
    """Judge by how much of the time the plane of a 2D lidar stays the same in the map.

    Parameters
    ----------
    normal : (3,) of its plane, lidar frame; None for a 3D lidar
    """
    if normal is None or not isinstance(found.mount, FixedMount):
        return []
    quats = trajectory.quats_xyzw[_moving(trajectory)]
    if len(quats) * DT < _SHORTEST:
        return []
    plane = np.broadcast_to(found.mount.T_imu_lidar.R @ normal, (len(quats), 3))
    normals = geometry.rotate(quats, plane)
    spread = np.linalg.eigvalsh(normals.T @ normals / len(normals))
    return [Evidence("slice", float(spread[2]))]


def _moving(trajectory: Trajectory) -> slice:
    """Return the poses behind the rest at the start."""
    away = np.linalg.norm(trajectory.positions - trajectory.positions[0], axis=1) > _AWAY
    away |= 1.0 - np.abs(trajectory.quats_xyzw @ trajectory.quats_xyzw[0]) > _AWAY**2
    return slice(int(np.argmax(away)) if away.any() else len(away), None)


def _offsets(found: Calibration, described: Calibration) -> dict[str, Array]:
    """Found less described, by the names of the standard deviations."""
    offsets: dict[str, Array] = {
        "latency": np.array([found.latency - described.latency]),
        "gyro_bias": found.gyro_bias,
        "accel_bias": found.accel_bias,
        "gyro_scale": np.diag(found.unit.gyro),
        "accel_scale": np.diag(found.unit.accel),
    }
    if isinstance(found.mount, FixedMount) and isinstance(described.mount, FixedMount):
        return offsets | _of_pose(found.mount.T_imu_lidar, described.mount.T_imu_lidar)
    if isinstance(found.mount, MotorMount) and isinstance(described.mount, MotorMount):
        mount, drawn = found.mount, described.mount
        offsets |= _of_pose(mount.T_imu_motor, drawn.T_imu_motor)
        offsets["encoder_zero"] = np.array([mount.encoder_zero - drawn.encoder_zero])
        lidar = _of_pose(mount.T_motor_lidar, drawn.T_motor_lidar)
        offsets["motor_tilt"] = lidar["extrinsic_rotation"]
        offsets["motor_offset"] = lidar["extrinsic_translation"]
        offsets["encoder_eccentricity"] = mount.errors.eccentricity - drawn.errors.eccentricity
        offsets["motor_wobble"] = (mount.errors.wobble - drawn.errors.wobble).ravel()
    return offsets


def _of_pose(found: Pose, described: Pose) -> dict[str, Array]:
    turn = geometry.multiply(found.quaternion, geometry.inverse(described.quaternion))
    return {
        "extrinsic_rotation": geometry.log(turn),
        "extrinsic_translation": found.translation - described.translation,
    }
