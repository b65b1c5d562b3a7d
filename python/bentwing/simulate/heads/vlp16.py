# SPDX-License-Identifier: MIT OR Apache-2.0
"""A VLP-16 under a quadrotor whose IMU sits on the body: fixed, or turned by a motor.

Turned as in Fu 2023 and Tazir 2020: the lidar lies on its side, its own axis perpendicular to
the motor's, and the motor's axis is the carrier's vertical, so that half a turn sees everything.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.airframe import quadrotor
from bentwing.simulate.heads.joints import Joint, Mount, Turn
from bentwing.simulate.lidars.interface import described_lidar
from bentwing.simulate.lidars.vlp16 import vlp16
from bentwing.simulate.rig import Encoder, Head
from bentwing.simulate.splines import Spline

if TYPE_CHECKING:
    from typing import Any

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

AXIS = np.array([0.0, 0.0, 1.0])
ON_ITS_SIDE = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""R_motor_lidar: the lidar's x down, its own axis z along the motor's x."""

UPRIGHT = {"box": {"min": [-0.65, -0.65, -0.35], "max": [0.65, 0.65, 0.3]}}
SIDEWAYS = {"box": {"min": [-0.3, -0.65, -0.65], "max": [0.32, 0.65, 0.65]}}
"""The carrier in the frame of a lidar that stands, and of one that lies on its side."""

T_body_imu = Mount(np.eye(3), np.array([0.03, 0.0, 0.02]))
MOTOR_STEP = 0.1


def vlp16_fixed(rng: np.random.Generator, max_range: float, doubt: float = 1.0) -> Head:
    """Build the lidar level under the body; `doubt` scales what is wrong, at 0 nothing is."""
    return _fixed(rng, Mount(np.eye(3), np.array([0.02, 0.0, -0.14])), max_range, doubt)


def vlp16_side(rng: np.random.Generator, max_range: float, doubt: float = 1.0) -> Head:
    """Build the lidar on its side, as a motor at rest has it (Tazir 2020, eqs. 1 to 3)."""
    return _fixed(rng, Mount(ON_ITS_SIDE, np.array([0.0, 0.0, -0.17])), max_range, doubt)


def _fixed(rng: np.random.Generator, nominal: Mount, max_range: float, doubt: float) -> Head:
    lidar = vlp16(max_range)
    true = _true(nominal, rng, doubt, np.radians(0.5), 0.004)
    payload = {
        "lidar": described_lidar(lidar, "vlp16", min_range=0.5),
        "T_imu_lidar": nominal.as_dict(),
        "self_hits": [UPRIGHT if np.array_equal(nominal.R, np.eye(3)) else SIDEWAYS],
    }
    truth = {"T_imu_lidar": true.as_dict()}
    return Head([T_body_imu], [true], quadrotor(), lidar, payload, truth)


def vlp16_motor(
    rng: np.random.Generator, rate: float, drive: Array, max_range: float, doubt: float = 1.0
) -> Head:
    """Build the lidar on a motor that turns at `rate` rad/s times `drive` (at the knots of `MOTOR_STEP`)."""
    lidar = vlp16(max_range)
    motor = Mount(np.eye(3), np.array([0.0, 0.0, -0.10]))
    nominal = Mount(ON_ITS_SIDE, np.array([0.0, 0.0, -0.07]))
    # What is unknown of T_imu_lidar sits before the motor, the misalignment behind it.
    true_motor = _true(motor, rng, doubt, np.radians(0.3), 0.003)
    true = _true(nominal, rng, doubt, np.radians(0.25), 0.002)
    angle = _motor_angle(rng, rate, drive)
    zero = doubt * float(rng.uniform(-0.004, 0.004)) if doubt else 0.0
    encoder = Encoder(angle, zero=zero, sigma=2e-4)
    payload = {
        "lidar": described_lidar(lidar, "vlp16", min_range=0.5),
        "self_hits": [SIDEWAYS],
        "encoder": {"topic": "/encoder", **_motor(motor, nominal)},
    }
    truth = {"encoder": {"zero": round(encoder.zero, 9), **_motor(true_motor, true)}}
    joints: list[Joint] = [true_motor, Turn(AXIS, angle), true]
    return Head([T_body_imu], joints, quadrotor(), lidar, payload, truth, encoder)


def _true(
    nominal: Mount, rng: np.random.Generator, doubt: float, angle: float, shift: float
) -> Mount:
    """Return a mount as it is, off by about `doubt` times an angle (rad) and a shift (m)."""
    return nominal.perturbed(rng, doubt * angle, doubt * shift) if doubt else nominal


def _motor(T_imu_motor: Mount, T_motor_lidar: Mount) -> dict[str, Any]:
    return {
        "axis": AXIS.tolist(),
        "T_imu_motor": T_imu_motor.as_dict(),
        "T_motor_lidar": T_motor_lidar.as_dict(),
    }


def _motor_angle(rng: np.random.Generator, rate: float, drive: Array) -> Spline:
    """From rest to full speed within a second, then with half a percent of ripple."""
    ramp = np.clip(MOTOR_STEP * np.arange(len(drive)) - 1.0, 0.0, 1.0)
    speed = rate * drive * ramp * (1.0 + rng.normal(0.0, 0.005, len(drive)))
    angle = rng.uniform(0.0, 2 * np.pi) + np.cumsum(speed) * MOTOR_STEP
    return Spline(MOTOR_STEP, angle[:, None])
