# SPDX-License-Identifier: MIT OR Apache-2.0
"""The flights of Tazir 2020, and the equations of their head."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError

from bentwing.simulate import Scenario
from bentwing.simulate.heads.joints import Mount
from bentwing.simulate.heads.vlp16 import AXIS, ON_ITS_SIDE
from bentwing.simulate.kinematics import rotation
from bentwing.simulate.simulation import prepare

LEVER = 0.17  # m, a_bI


@pytest.mark.parametrize(("alpha", "beta", "r"), [(0.3, 0.1, 12.0), (-2.5, -0.25, 40.0)])
def test_the_lidar_on_its_side_is_that_of_equations_1_to_3(alpha, beta, r):
    """α from the lidar's x, which points down, β off the plane of the beams' turn."""
    mount = Mount(ON_ITS_SIDE, np.array([0.0, 0.0, -LEVER]))
    flat = r * np.cos(beta)
    point = np.array([flat * np.cos(alpha), flat * np.sin(alpha), r * np.sin(beta)])
    expected = [
        r * np.sin(beta),
        r * np.cos(beta) * np.sin(alpha),
        -r * np.cos(beta) * np.cos(alpha) - LEVER,
    ]
    assert mount.R @ point + mount.t == pytest.approx(expected)


@pytest.mark.parametrize("theta", [0.0, 0.7, 2.9, -1.2])
@pytest.mark.parametrize(("alpha", "beta", "r"), [(0.3, 0.1, 12.0), (-2.5, -0.25, 40.0)])
def test_the_motor_turns_as_in_equations_4_to_6(theta, alpha, beta, r):
    """A Velodyne turns clockwise, and the paper's θ is zero a quarter turn after that of eqs. 1-3."""
    flat = r * np.cos(beta)
    point = np.array([flat * np.cos(alpha), -flat * np.sin(alpha), r * np.sin(beta)])
    turn = rotation((theta + np.pi / 2) * AXIS[None])[0]
    found = turn @ (ON_ITS_SIDE @ point) - [0.0, 0.0, LEVER]
    expected = [
        r * (np.cos(beta) * np.sin(alpha) * np.cos(theta) - np.sin(beta) * np.sin(theta)),
        r * (np.sin(beta) * np.cos(theta) + np.cos(beta) * np.sin(alpha) * np.sin(theta)),
        -r * np.cos(beta) * np.cos(alpha) - LEVER,
    ]
    assert found == pytest.approx(expected)


def test_a_survey_of_the_town_flies_a_hundred_metres_at_one_metre_a_second():
    setup = prepare(Scenario(scene="town", flight="survey", duration=104.0))
    motion = setup.rig.imu(np.linspace(0.0, 104.0, 1041))
    way = np.linalg.norm(np.diff(motion.p[::10], axis=0), axis=1).sum()
    assert way == pytest.approx(100.0, abs=3.0)
    assert np.median(np.linalg.norm(motion.v, axis=1)) == pytest.approx(1.0, abs=0.1)
    assert motion.p[:, 2] == pytest.approx(np.full(1041, 30.0), abs=0.5)


def test_the_dam_is_flown_over_at_70_m_and_4_metres_a_second():
    setup = prepare(Scenario(scene="dam", duration=60.0))
    motion = setup.rig.imu(np.linspace(5.0, 55.0, 501))
    assert np.median(np.linalg.norm(motion.v, axis=1)) == pytest.approx(4.0, abs=0.2)
    assert setup.world.clearance(motion.p).min() > 15.0


def test_between_the_walls_the_lidar_stands_still_with_the_motors_axis_towards_one_of_them():
    setup = prepare(Scenario(scene="walls", duration=10.0))
    motion = setup.rig.imu(np.array([0.0, 5.0, 9.0]))
    assert np.ptp(motion.p, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.abs(motion.R[0] @ AXIS) == pytest.approx([1.0, 0.0, 0.0], abs=1e-9)
    centre = motion.p[:1].repeat(2, axis=0)
    ranges, _ = setup.world.scene.cast(centre, np.eye(3)[:2].copy(), 50.0)
    assert ranges == pytest.approx([10.0, 10.0], abs=0.1)


def test_on_a_stand_the_head_is_still_and_away_from_everything():
    setup = prepare(Scenario(scene="office", head="vlp16-motor", flight="stand", duration=10.0))
    motion = setup.rig.imu(np.array([0.0, 5.0, 9.0]))
    assert np.ptp(motion.p, axis=0) == pytest.approx(np.zeros(3), abs=1e-12)
    assert np.degrees(np.arccos(motion.R[0, 2, 2])) < 6.0
    assert setup.world.clearance(motion.p).min() > 0.9


def test_a_motor_that_turns_back_turns_as_fast_in_both_directions():
    scenario = Scenario(
        scene="office", head="vlp16-motor", flight="stand", motor_rate=3.0, duration=10.0,
        events=["motor-reversal"],
    )  # fmt: skip
    encoder = prepare(scenario).rig.head.encoder
    assert encoder is not None
    rates = encoder.angle(np.array([3.0, 4.0, 6.0, 9.0]), 1)[:, 0]
    assert rates == pytest.approx([3.0, 3.0, -3.0, -3.0], rel=0.05)


def test_a_calibrated_head_is_as_its_payload_says():
    setup = prepare(Scenario(scene="dam", calibrated=True, duration=10.0))
    head = setup.rig.head
    for name in ("T_imu_motor", "T_motor_lidar"):
        assert head.truth["encoder"][name] == head.payload["encoder"][name]
    assert head.truth["encoder"]["zero"] == 0.0
    assert setup.sensors.clock.latency == 0.0


@pytest.mark.parametrize(
    "wrong",
    [
        {"scene": "office", "flight": "survey"},
        {"scene": "dam", "flight": "tour"},
        {"scene": "walls", "head": "hokuyo-nod"},
        {"scene": "walls", "flight": "stand"},
        {"scene": "office", "head": "hokuyo-nod", "flight": "stand"},
    ],
)
def test_what_cannot_be_flown_is_refused(wrong):
    with pytest.raises(ValidationError, match="choose"):
        Scenario(**wrong)
