# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import numpy as np
import pytest

from bentwing.base.breaks import Break
from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory

CUT = "and what was seen before and after does not fit together: the trajectory begins anew there, in the direction of the last motion; what follows is accurate in itself, but its place relative to what came before"  # fmt: skip
SILENCE = Break("lidar", 8.0, 15.02)


@pytest.mark.parametrize(
    ("broken", "sentence"),
    [
        (SILENCE, f"no lidar data from 8.00 to 15.02 s, {CUT} is a guess"),
        (
            replace(SILENCE, outcome="not found"),
            f"no lidar data from 8.00 to 15.02 s, {CUT} is a guess: no place was found that both "
            "sides have seen",
        ),
        (
            replace(SILENCE, sensor="inertial", outcome="found", n_places=3),
            f"no inertial data from 8.00 to 15.02 s, {CUT} was found again by 3 places that more "
            "than one segment has seen",
        ),
        (
            replace(SILENCE, outcome="bridged"),
            "no lidar data from 8.00 to 15.02 s: the trajectory there is a guess; what was seen "
            "before and after fits together",
        ),
        (
            replace(SILENCE, sensor="head", outcome="bridged"),
            "the head stood still from 8.00 to 15.02 s: the trajectory there is the IMU's and "
            "single planes'; what was seen before and after fits together",
        ),
        (
            replace(SILENCE, sensor="scan"),
            "no scan from 8.00 to 15.02 s fits what was seen before: the trajectory begins anew "
            "there, in the direction of the last motion; what follows is consistent in itself, but "
            "its place relative to what came before is a guess",
        ),
        (
            replace(SILENCE, sensor="inertial", outcome="left out"),
            "the inertial data end at 8.00 s, 7.0 s before the lidar's: what the lidar saw after "
            "that is left out",
        ),
    ],
)
def test_a_break_says_what_happened_and_what_follows(broken, sentence):
    assert broken.sentence() == sentence


def test_the_warnings_of_an_estimate_are_its_health_and_then_its_breaks():
    still = np.array([[0.0, 0.0, 0.0, 1.0]])
    mount = FixedMount(Pose(np.zeros(3), still[0]))
    estimate = Estimate(
        Trajectory(np.zeros(1), np.zeros((1, 3)), still),
        Calibration(0.0, mount, np.zeros(3), np.zeros(3), np.zeros(3)),
        health=["one plane only"],
        breaks=[SILENCE],
    )
    assert estimate.warnings == ["one plane only", SILENCE.sentence()]
