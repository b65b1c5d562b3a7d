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
    assert re.search(names, both_meanings(gyro, accel, SCANS_ACROSS_Z) or "")


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
    assert both_meanings(gyro, accel, R) is None
