# SPDX-License-Identifier: MIT OR Apache-2.0
"""The link against a MAVLink endpoint on the loopback."""

from __future__ import annotations

import gc
import math
import os
import time

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import UsageError
from bentwing.flight.control.link import Attitude, Distance, Sticks
from bentwing.flight.control.springs import Springs

os.environ["MAVLINK20"] = "1"  # pymavlink reads it when it is imported
mavutil = pytest.importorskip("pymavlink.mavutil", reason="the extra `mavlink` is not installed")
from bentwing.flight.control.mavlink import MavlinkLink  # noqa: E402
from bentwing.flight.control.mavlink_endpoint import MOST_AT_ONCE  # noqa: E402

PATIENCE = 5.0


def at(address, system=1, component=1):
    """An endpoint of another program."""
    return mavutil.mavlink_connection(
        address, source_system=system, source_component=component, dialect="common"
    )


@pytest.fixture
def pair():
    """An autopilot and the link to it."""
    autopilot = at("udpin:127.0.0.1:0")
    port = autopilot.port.getsockname()[1]
    with MavlinkLink(f"udpout:127.0.0.1:{port}") as link:
        link.send_warning("hello")  # an endpoint answers to who has spoken
        assert heard(autopilot, "STATUSTEXT").text == "hello"
        yield autopilot, link
    autopilot.close()


def heard(autopilot, kind):
    message = autopilot.recv_match(type=kind, blocking=True, timeout=PATIENCE)
    assert message is not None, f"no {kind} came"
    return message


def received(link, n):
    found, until = [], time.monotonic() + PATIENCE
    while len(found) + sum(link.refused.values()) < n and time.monotonic() < until:
        found += link.receive()
    return found


def test_attitude_distance_and_sticks_come_in_with_our_signs(pair):
    autopilot, link = pair
    autopilot.mav.attitude_send(2500, 0.1, 0.2, 0.3, 0.0, 0.0, 0.0)
    autopilot.mav.distance_sensor_send(2600, 10, 1000, 345, 0, 0, 25, 0)
    autopilot.mav.manual_control_send(1, 500, -250, 400, 0, 0)
    attitude, distance, sticks = received(link, 3)
    assert isinstance(attitude, Attitude)
    assert attitude.time == 2.5
    assert (attitude.roll, attitude.pitch, attitude.yaw) == pytest.approx((0.1, -0.2, -0.3))
    assert distance == Distance(2.6, 3.45, is_downward=True)
    assert sticks == Sticks(roll=-0.25, pitch=0.5, thrust=0.4)


def test_what_is_not_finite_or_out_of_range_is_refused(pair):
    autopilot, link = pair
    autopilot.mav.attitude_send(1, math.nan, 0.0, 0.0, 0.0, 0.0, 0.0)
    autopilot.mav.distance_sensor_send(1, 10, 1000, 2000, 0, 0, 25, 0)
    autopilot.mav.manual_control_send(1, 32767, 0, 0, 0, 0)
    assert received(link, 3) == []
    assert link.refused == {"ATTITUDE": 1, "DISTANCE_SENSOR": 1, "MANUAL_CONTROL": 1}


def test_an_attitude_goes_out_as_a_quaternion_of_the_other_body_frame(pair):
    autopilot, link = pair
    link.send_attitude(roll=0.2, pitch=0.1, yaw=-0.4, thrust=0.55)
    sent = heard(autopilot, "SET_ATTITUDE_TARGET")
    w, x, y, z = sent.q
    up = geometry.rotate(np.array([[x, y, z, w]]), np.array([[0.0, 0.0, -1.0]]))[0]
    # yaw 0.4 clockwise, nose down by 0.1, to the right by 0.2: the thrust points right of ahead
    assert sent.thrust == pytest.approx(0.55)
    assert math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)) == pytest.approx(0.4)
    assert math.asin(2 * (w * y - z * x)) == pytest.approx(-0.1)
    assert math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)) == pytest.approx(0.2)
    assert up[2] < -0.9


@pytest.mark.parametrize("thrust", [math.nan, -0.1, 1.1])
def test_an_impossible_attitude_is_not_sent(pair, thrust):
    _, link = pair
    with pytest.raises(ValueError, match="thrust of 0 to 1"):
        link.send_attitude(0.0, 0.0, 0.0, thrust)


def test_gaps_go_out_clockwise_from_ahead(pair):
    autopilot, link = pair
    left, ahead = [0.0, 1.0], [1.0, 0.0]
    link.send_gaps(Springs(np.array([left, ahead]), np.array([0.5, 1.234])), yaw=0.0)
    sent = heard(autopilot, "OBSTACLE_DISTANCE")
    assert sent.distances[0] == 123
    assert sent.distances[54] == 50
    assert set(sent.distances) == {123, 50, 65535}


def test_a_long_warning_is_cut(pair):
    autopilot, link = pair
    link.send_warning("x" * 80)
    assert heard(autopilot, "STATUSTEXT").text == "x" * 50


# pymavlink leaves its socket to the garbage collector when it cannot bind it
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_address_that_cannot_be_opened_is_named():
    with pytest.raises(UsageError, match="nowhere"):
        MavlinkLink("udpin:nowhere.invalid:1")
    gc.collect()


ATTITUDE = (1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0)


@pytest.fixture
def listening():
    """A function that makes a link that others call, and says where; all ends are closed."""
    ends = []

    def make(**options):
        link = MavlinkLink("udpin:127.0.0.1:0", **options)
        port = link._connection.port.getsockname()[1]

        def caller(system=1, component=1):
            ends.append(at(f"udpout:127.0.0.1:{port}", system, component))
            return ends[-1]

        ends.append(link)
        return link, caller

    yield make
    for end in ends:
        end.close()


def test_only_the_autopilot_is_heard_and_answered(listening):
    link, caller = listening()
    others = [caller(system=2), caller(component=7), caller(system=255, component=190)]
    for other in others:
        other.mav.attitude_send(*ATTITUDE)
        other.mav.manual_control_send(1, 500, 0, 0, 0, 0)
    assert received(link, 6) == []
    assert link.refused == {"another sender": 6}
    link.send_warning("to nobody")
    autopilot = caller()
    autopilot.mav.attitude_send(*ATTITUDE)
    assert len(received(link, 7)) == 1
    link.send_warning("to the autopilot")
    assert heard(autopilot, "STATUSTEXT").text == "to the autopilot"
    assert all(other.recv_msg() is None for other in others)


def test_who_feigns_the_numbers_of_the_autopilot_from_elsewhere_is_not_heard_beside_it(listening):
    link, caller = listening()
    autopilot, impostor = caller(), caller()
    autopilot.mav.attitude_send(*ATTITUDE)
    assert len(received(link, 1)) == 1
    impostor.mav.attitude_send(*ATTITUDE)
    assert received(link, 1) == []
    assert link.refused == {"another address": 1}


def test_the_sticks_may_come_from_a_ground_station_that_is_named(listening):
    link, caller = listening(pilot=255)
    station = caller(system=255, component=190)
    station.mav.attitude_send(*ATTITUDE)
    station.mav.manual_control_send(1, 500, 0, 400, 0, 0)
    assert received(link, 2) == [Sticks(roll=0.0, pitch=0.5, thrust=0.4)]


def test_with_a_key_what_is_not_signed_with_it_is_refused(listening):
    key = bytes(range(32))
    link, caller = listening(key=key)
    plain, wrong = caller(), caller()
    wrong.setup_signing(bytes(32), sign_outgoing=True)
    for end in (plain, wrong):
        end.mav.attitude_send(*ATTITUDE)
    assert received(link, 2) == []
    assert link.refused == {"damaged or not signed": 2}
    autopilot = caller()
    autopilot.setup_signing(key, sign_outgoing=True)
    autopilot.mav.attitude_send(*ATTITUDE)
    assert len(received(link, 3)) == 1
    link.send_warning("signed")
    assert heard(autopilot, "STATUSTEXT").get_signed()


def test_a_key_of_another_length_is_refused():
    with pytest.raises(UsageError, match="key: expected 32 bytes, got 3"):
        MavlinkLink("udpin:127.0.0.1:0", key=b"abc")


def test_a_flood_does_not_hold_up_the_caller(listening):
    link, caller = listening()
    autopilot = caller()
    for _ in range(2 * MOST_AT_ONCE):
        autopilot.mav.attitude_send(*ATTITUDE)
    until, found = time.monotonic() + PATIENCE, []
    while not found and time.monotonic() < until:
        found = link.receive()
    assert 0 < len(found) <= MOST_AT_ONCE


def test_bytes_that_are_no_messages_are_counted_and_nothing_else(listening):
    link, caller = listening()
    noise, rng = caller(), np.random.default_rng(1)
    for _ in range(200):
        noise.port.sendto(rng.bytes(int(rng.integers(1, 300))), noise.destination_addr)
    until = time.monotonic() + 1.0
    while time.monotonic() < until and not link.refused:
        assert link.receive() == []
    assert set(link.refused) <= {"damaged or not signed", "another sender"}
