# SPDX-License-Identifier: MIT OR Apache-2.0
import copy
import pickle
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, MotorMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch

POSE = Pose(np.array([1.0, 2.0, 3.0]), np.array([0.0, 0.0, 0.0, 1.0]))
CALIBRATION = Calibration(
    0.001,
    MotorMount(POSE, np.array([0.0, 0.0, 1.0]), 0.1, POSE),
    np.ones(3),
    np.ones(3),
    np.ones(3),
)
TRAJECTORY = Trajectory([0.0, 1.0], np.zeros((2, 3)), [[0, 0, 0, 1]] * 2)
VALUES = {
    "pose": POSE,
    "fixed mount": FixedMount(POSE),
    "motor mount": CALIBRATION.mount,
    "calibration": CALIBRATION,
    "estimate": Estimate(TRAJECTORY, CALIBRATION, counts={"windows": 3}),
    "points": LidarBatch(np.ones((2, 3)), np.arange(2.0), ring=np.zeros(2, np.uint16)),
    "inertial samples": ImuBatch(np.arange(2.0), np.ones((2, 3)), np.ones((2, 3))),
    "angles": EncoderBatch(np.arange(2.0), np.ones(2)),
}


@pytest.mark.parametrize("value", VALUES.values(), ids=VALUES.keys())
def test_a_value_equals_its_copies_and_pickles_and_nothing_of_another_type(value):
    assert copy.deepcopy(value) == value
    assert pickle.loads(pickle.dumps(value)) == value
    assert value != 3
    assert value != VALUES["pose" if value is not POSE else "angles"]


def test_one_element_makes_a_difference():
    moved = replace(POSE, translation=POSE.translation + np.array([0.0, 0.0, 1e-9]))
    assert moved != POSE
    assert FixedMount(moved) != FixedMount(POSE)
    assert replace(CALIBRATION, gyro_bias=np.zeros(3)) != CALIBRATION
    points = VALUES["points"]
    assert replace(points, ring=None) != points
