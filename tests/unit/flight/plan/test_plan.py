# SPDX-License-Identifier: MIT OR Apache-2.0
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bentwing.base.errors import UsageError
from bentwing.flight.plan import Intent, plan_flight
from bentwing.flight.plan.patterns import PATTERNS
from bentwing.flight.plan.plan import spin_range
from bentwing.recording import Payload

DOWN = {"translation": [0.06, 0.01, 0.04], "quaternion": [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)]}
BENTWING = {"lidar": {"kind": "hokuyo-utm30lx"}, "imu": {}, "T_imu_lidar": DOWN}
TILTED = {"quaternion": [0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)]}
MOTOR = {
    "lidar": {"kind": "vlp16"},
    "imu": {},
    "encoder": {"axis": [0, 0, 1], "T_motor_lidar": TILTED},
}


def plan(payload, **intent):
    return plan_flight(Payload.model_validate(payload), Intent(**intent))


def test_the_papers_range_comes_out_for_the_papers_head():
    made = plan(BENTWING)
    assert made.spin is not None
    assert made.spin.rounded_deg == (150, 460)
    assert math.degrees(made.spin.lines) == pytest.approx(458.4, abs=0.1)
    assert math.degrees(made.spin.revolutions) == pytest.approx(72.0, abs=0.1)


def test_the_papers_head_is_blind_in_a_cone_of_90_degrees_above():
    seen = plan(BENTWING).coverage
    assert math.degrees(seen.blind_up) == pytest.approx(90.0, abs=3.0)
    assert seen.blind_down == 0.0
    assert math.degrees(seen.sweep) == pytest.approx(180.0, abs=3.0)
    assert seen.share == pytest.approx((1 + math.sqrt(0.5)) / 2, abs=0.02)


def test_lines_are_as_far_apart_as_the_head_turns_between_sweeps():
    made = plan(BENTWING)
    at_five = next(s for s in made.spacings if s.range == 5.0)
    assert at_five.across == pytest.approx(5.0 * made.rate * 0.01)
    assert at_five.along == pytest.approx(5.0 * math.radians(0.65))
    assert all(s.range <= 30.0 for s in made.spacings)


@given(distance=st.floats(1.0, 30.0), speed=st.floats(0.2, 5.0))
def test_nearer_structure_allows_faster_spinning_and_demands_it_at_speed(distance, speed):
    near, far = (
        spin_range(PATTERNS["hokuyo-utm30lx"], math.pi, Intent(distance=d, speed=speed))
        for d in (0.9 * distance, distance)
    )
    assert near.lines > far.lines
    assert near.reobservation > far.reobservation


def test_a_motor_turned_lidar_sees_all_around():
    made = plan(MOTOR)
    assert made.turning.turned == "motor"
    assert made.coverage.share == pytest.approx(1.0, abs=0.01)
    assert made.spin is not None
    assert math.degrees(made.spin.lines) == pytest.approx(10 * (30.0 + math.degrees(0.08)), abs=0.1)


def test_a_fixed_lidar_has_no_spin_and_sees_its_own_swath():
    made = plan({"lidar": {"kind": "vlp16"}, "imu": {}, "T_imu_lidar": {}})
    assert made.spin is None
    assert made.rate == 0.0
    assert made.coverage.share == pytest.approx(math.sin(math.radians(15.0)), abs=0.03)
    assert made.coverage.blind_up == pytest.approx(made.coverage.blind_down, abs=0.12)


@pytest.mark.parametrize(
    "kind", ["hokuyo-utm30lx", "vlp16", "ouster", "livox", "hesai", "robosense", "generic"]
)
def test_every_kind_of_lidar_can_be_planned(kind):
    made = plan({"lidar": {"kind": kind}, "imu": {}, "T_imu_lidar": {}})
    assert 0.0 < made.coverage.share <= 1.0
    assert np.isfinite(made.site_time)


def test_a_faster_scanner_allows_faster_spinning():
    spin = plan(BENTWING, scan_rate_hz=200.0).spin
    assert math.degrees(spin.lines) == pytest.approx(2 * 458.4, abs=0.2)


def test_far_and_fast_leaves_no_acceptable_rate():
    assert plan(BENTWING, distance=25.0, speed=20.0).spin.is_empty


def test_larger_sites_take_more_batteries():
    small, large = plan(BENTWING), plan(BENTWING, area=25_000.0)
    assert small.n_flights == 1
    assert large.n_flights == 5
    assert large.site_time == pytest.approx(2500.0 + 5 * 60.0)


@pytest.mark.parametrize(
    ("intent", "reason"),
    [
        ({"distance": 40.0}, "beyond the 30 m"),
        ({"speed": 0.0}, "speed"),
        ({"window": math.nan}, "window"),
        ({"flight_time": 30.0}, "flight_time"),
    ],
)
def test_impossible_intents_are_refused(intent, reason):
    with pytest.raises(UsageError, match=reason):
        plan(BENTWING, **intent)
