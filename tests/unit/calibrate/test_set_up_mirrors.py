# SPDX-License-Identifier: MIT OR Apache-2.0
"""Axes of which a 2D lidar cannot tell which are right."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.calibrate.set_up.mirrors import both_meanings

PLAIN = np.eye(3)
SCANS_ACROSS_Z = PLAIN
SCANS_ACROSS_X = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])


@pytest.mark.parametrize(
    ("gyro", "accel", "names"),
    [
        (
            PLAIN,
            np.diag([1.0, 1.0, -1.0]),
            r"accelerometer are \[x, y, -z\].*gyro are \[-x, -y, z\]",
        ),
        (
            np.diag([-1.0, -1.0, 1.0]),
            PLAIN,
            r"gyro are \[-x, -y, z\].*accelerometer are \[x, y, -z\]",
        ),
        (PLAIN, -PLAIN, "half a turn about the normal"),
        (-PLAIN, PLAIN, "all axes of the gyro are negated"),
    ],
)
def test_both_meanings_are_named(gyro, accel, names):
    assert re.search(names, both_meanings(gyro, accel, SCANS_ACROSS_Z, SCANS_ACROSS_Z) or "")


@pytest.mark.parametrize(
    ("gyro", "accel", "R"),
    [
        (PLAIN, np.diag([-1.0, 1.0, 1.0]), SCANS_ACROSS_Z),
        (PLAIN, np.diag([1.0, 1.0, -1.0]), SCANS_ACROSS_X),
        (np.diag([1.0, -1.0, 1.0]), PLAIN, SCANS_ACROSS_Z),
        (np.diag([-1.0, 1.0, 1.0]), np.diag([-1.0, 1.0, 1.0]), SCANS_ACROSS_Z),
        (
            PLAIN,
            np.diag([1.0, 1.0, -1.0]),
            geometry.to_matrices(geometry.exp(np.array([[0.8, 0.0, 0.0]])))[0],
        ),
    ],
)
def test_axes_whose_mirror_image_blames_both_sensors_are_believed(gyro, accel, R):
    assert both_meanings(gyro, accel, R, R) is None


def test_a_mount_of_half_a_turn_about_the_normal_of_the_scans_may_be_a_negated_accelerometer():
    tilt = geometry.to_matrices(geometry.exp(np.array([[0.02, -0.01, 0.03]])))[0]
    found = SCANS_ACROSS_X @ np.diag([-1.0, -1.0, 1.0]) @ tilt
    assert "half a turn about the normal" in (
        both_meanings(PLAIN, PLAIN, found, SCANS_ACROSS_X) or ""
    )


@pytest.mark.parametrize(
    "half_turn", [np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0]), PLAIN]
)
def test_other_mounts_are_believed(half_turn):
    assert both_meanings(PLAIN, PLAIN, SCANS_ACROSS_X @ half_turn, SCANS_ACROSS_X) is None
