# SPDX-License-Identifier: MIT OR Apache-2.0
"""The simplest description of a head that explains how its IMU follows the lidar."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bentwing.calibrate.set_up import axes, edits
from bentwing.calibrate.set_up.compare import findings_between
from bentwing.calibrate.set_up.explain import explain
from bentwing.recording import Payload

DESCRIBED = Rotation.from_euler("xyz", [10, -20, 70], degrees=True).as_matrix()
MIRROR = np.diag([1.0, -1.0, 1.0])
CYCLIC = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
SWAPPED = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])


def test_there_are_48_signed_axes_and_the_first_changes_nothing() -> None:
    found = [tuple(P.ravel()) for P in axes.signed_permutations()]
    assert len(set(found)) == 48
    assert found[0] == tuple(np.eye(3).ravel())


@pytest.mark.parametrize("P", list(axes.signed_permutations()))
def test_names_of_axes_read_as_the_axes_they_were_made_of(P: np.ndarray) -> None:
    np.testing.assert_array_equal(axes.of(axes.named(P)), P)


def test_a_head_as_described_needs_no_explanation() -> None:
    found = explain(DESCRIBED, DESCRIBED, DESCRIBED)
    assert found is not None
    assert found.cost == 0.0
    np.testing.assert_array_equal(found.gyro_axes, np.eye(3))
    np.testing.assert_array_equal(found.accel_axes, np.eye(3))
    assert not found.mirrored


@pytest.mark.parametrize("seed", range(10))
def test_both_sensors_in_another_direction_are_another_mount(seed: int) -> None:
    true = Rotation.random(random_state=seed).as_matrix()
    found = explain(true, true, DESCRIBED)
    assert found is not None
    np.testing.assert_allclose(found.R_imu_lidar, true, atol=1e-12)
    np.testing.assert_array_equal(found.gyro_axes, np.eye(3))
    assert not found.mirrored


@pytest.mark.parametrize("P", [CYCLIC, SWAPPED, np.diag([1.0, 1, -1]), -np.eye(3)])
def test_a_gyro_on_other_axes_is_told_from_an_accelerometer_on_other_axes(P: np.ndarray) -> None:
    gyro = explain(P.T @ DESCRIBED, DESCRIBED, DESCRIBED)
    assert gyro is not None
    np.testing.assert_array_equal(gyro.gyro_axes, P)
    np.testing.assert_array_equal(gyro.accel_axes, np.eye(3))
    if np.linalg.det(P) > 0.0:
        accel = explain(DESCRIBED, P.T @ DESCRIBED, DESCRIBED)
        assert accel is not None
        np.testing.assert_array_equal(accel.accel_axes, P)
        np.testing.assert_array_equal(accel.gyro_axes, np.eye(3))


def test_a_left_handed_imu_is_one_cause_not_two() -> None:
    found = explain(SWAPPED @ DESCRIBED, SWAPPED @ DESCRIBED, DESCRIBED)
    assert found is not None
    np.testing.assert_array_equal(found.gyro_axes, SWAPPED)
    np.testing.assert_array_equal(found.accel_axes, SWAPPED)
    np.testing.assert_allclose(found.R_imu_lidar, DESCRIBED, atol=1e-12)


def test_a_mirrored_scan_is_told_by_the_mount_that_is_described() -> None:
    # A lidar that sees its mirror image turns the other way, but accelerates as its image does.
    found = explain(-DESCRIBED @ MIRROR, DESCRIBED @ MIRROR, DESCRIBED)
    assert found is not None
    assert found.mirrored
    np.testing.assert_allclose(found.R_imu_lidar, DESCRIBED, atol=1e-12)


def test_axes_that_are_no_axes_have_no_explanation() -> None:
    skew = Rotation.from_euler("xyz", [40, 30, 20], degrees=True).as_matrix()
    assert explain(DESCRIBED, skew @ DESCRIBED, DESCRIBED) is None


def test_a_mount_that_no_payload_tells_is_said_with_its_line() -> None:
    bare = Payload(imu={})
    (finding,) = findings_between(bare, edits.with_rotation(bare, DESCRIBED))
    assert finding.kind == "mount"
    assert finding.line.startswith("T_imu_lidar: ")
