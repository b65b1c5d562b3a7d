# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is true of a simulated unit, in the frame of its gyro."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import FixedMount, Pose
from bentwing.evaluate.simulated.unit import in_frame_of, unit_errors

LIDAR = Pose(np.array([0.1, -0.05, 0.2]), geometry.exp(np.array([0.4, -0.2, 1.0])))
UP = np.array([0.0, 0.0, 9.81])


def drawn(rng):
    """Return a response, and the calibration as the simulation defines it."""
    response = {
        "gyro": np.eye(3) + rng.normal(0.0, 0.01, (3, 3)),
        "accel": np.eye(3) + rng.normal(0.0, 0.01, (3, 3)),
        "g_sensitivity": rng.normal(0.0, 2e-4, (3, 3)),
    }
    biases = rng.normal(0.0, 0.02, 3), rng.normal(0.0, 0.1, 3)
    return response, Calibration(0.0, FixedMount(LIDAR), *biases, UP)


def found(main_axis, reference):
    unit = InertialUnit(reference=reference, main_axis=main_axis)
    return Calibration(0.0, FixedMount(LIDAR), np.zeros(3), np.zeros(3), UP, unit=unit)


@pytest.mark.parametrize("main_axis", [0, 1, 2])
def test_the_true_unit_turns_samples_into_rates_and_forces_of_one_frame(main_axis):
    rng = np.random.default_rng(5)
    response, true = drawn(rng)
    in_frame = in_frame_of(found(main_axis, UP + np.array([0.3, -0.2, 0.0])), true, response)
    rates, forces = rng.normal(size=(9, 3)), rng.normal(size=(9, 3)) + UP
    accel = forces @ response["accel"].T + true.accel_bias
    gyro = rates @ response["gyro"].T + forces @ response["g_sensitivity"].T + true.gyro_bias
    mount, simulated = in_frame.mount.T_imu_lidar, true.mount.T_imu_lidar
    R = mount.R @ simulated.R.T
    unit = in_frame.unit
    np.testing.assert_allclose(unit.rates(gyro, accel, in_frame.gyro_bias), rates @ R.T, atol=1e-12)
    np.testing.assert_allclose(unit.forces(accel, in_frame.accel_bias), forces @ R.T, atol=1e-12)
    np.testing.assert_allclose(mount.translation, R @ simulated.translation, atol=1e-12)
    # The frame is that of the gyro: turns about the main axis are felt by it alone.
    i, j = (main_axis + 1) % 3, (main_axis + 2) % 3
    np.testing.assert_allclose(unit.gyro[[i, j], main_axis], 0.0, atol=1e-12)
    assert unit.gyro[i, j] == pytest.approx(unit.gyro[j, i])
    assert 0.001 < np.arccos((np.trace(R) - 1) / 2) < 0.05


def test_a_perfect_unit_stays_in_its_frame():
    _, true = drawn(np.random.default_rng(6))
    in_frame = in_frame_of(found(2, UP), true, None)
    np.testing.assert_allclose(in_frame.mount.T_imu_lidar.matrix, LIDAR.matrix, atol=1e-15)
    np.testing.assert_allclose(in_frame.accel_bias, true.accel_bias, atol=1e-12)
    errors = unit_errors(InertialUnit(reference=UP), in_frame.unit)
    assert max(float(np.abs(e).max()) for e in errors.values()) < 1e-14
