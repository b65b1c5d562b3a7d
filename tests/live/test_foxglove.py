# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a client of Foxglove's protocol hears of live odometry, read by an independent reader of its schemas."""

from __future__ import annotations

import asyncio
import json
import struct
import sys
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.flight import FoxgloveServer, StampedPose
from bentwing.flight.live.messages import MOST_POINTS, LiveMessages
from bentwing.recording.messages.ros_messages import RosMessages

START_NS = 1_700_000_000 * 10**9
MESSAGE_DATA = 1  # first byte of a message


async def heard(port, act):
    """Subscribe to all that is advertised, act, and return the messages by topic as (ns, message)."""
    from mcap_ros2._dynamic import generate_dynamic
    from tornado.websocket import websocket_connect

    client = await websocket_connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"])
    channels = {}
    while len(channels) < 5:
        told = await asyncio.wait_for(client.read_message(), 10)
        if isinstance(told, str) and (said := json.loads(told))["op"] == "advertise":
            channels |= {one["id"]: one for one in said["channels"]}
    wanted = [{"id": 100 + number, "channelId": number} for number in channels]
    await client.write_message(json.dumps({"op": "subscribe", "subscriptions": wanted}))
    await asyncio.sleep(0.2)
    act()
    found = {one["topic"]: [] for one in channels.values()}
    while True:
        try:
            told = await asyncio.wait_for(client.read_message(), 1)
        except asyncio.TimeoutError:
            client.close()
            return found, channels
        if isinstance(told, bytes) and told[0] == MESSAGE_DATA:
            subscription, stamp_ns = struct.unpack_from("<IQ", told, 1)
            channel = channels[subscription - 100]
            name = channel["schemaName"]
            message = generate_dynamic(name, channel["schema"])[name](told[13:])
            found[channel["topic"]].append((stamp_ns, message))


@pytest.fixture
def server():
    pytest.importorskip("foxglove", reason="the extra `foxglove` is not installed")
    with FoxgloveServer(0, start_ns=START_NS) as server:
        yield server


def test_a_client_hears_pose_path_map_and_status(server, new, flight):
    odometry = new()
    server.show(odometry)  # nothing is known, but the topics are announced

    def fly():
        for batch in flight.batches:
            odometry.feed(batch)
        odometry.wait()
        for _ in range(3):  # of which the later ones have nothing new to tell
            server.show(odometry)

    found, channels = asyncio.run(heard(server.port, fly))
    assert {one["topic"]: one["schemaName"] for one in channels.values()} == {
        "/bentwing/odometry": "nav_msgs/msg/Odometry",
        "/bentwing/path": "nav_msgs/msg/Path",
        "/tf": "tf2_msgs/msg/TFMessage",
        "/bentwing/map_points": "sensor_msgs/msg/PointCloud2",
        "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray",
    }
    assert {len(messages) for messages in found.values()} == {1}
    newest = odometry.pose()
    stamps = {stamp_ns for ((stamp_ns, _),) in found.values()}
    assert stamps == {START_NS + round(newest.time * 1e9)}

    ((_, said),) = found["/bentwing/odometry"]
    place, turn = said.pose.pose.position, said.pose.pose.orientation
    np.testing.assert_allclose([place.x, place.y, place.z], newest.position, atol=1e-15)
    np.testing.assert_allclose([turn.x, turn.y, turn.z, turn.w], newest.quat_xyzw, atol=1e-15)
    assert (said.header.frame_id, said.child_frame_id) == ("map", "imu")
    ((_, links),) = found["/tf"]
    assert links.transforms[0].transform.translation.x == place.x
    ((_, path),) = found["/bentwing/path"]
    assert [pose.pose.position.z for pose in path.poses] == [place.z]
    ((_, cloud),) = found["/bentwing/map_points"]
    points = np.frombuffer(cloud.data, "<f4").reshape(cloud.width, -1)
    np.testing.assert_array_equal(points, odometry.map_points())
    ((_, diagnostics),) = found["/diagnostics"]
    (status,) = diagnostics.status
    assert (status.message, status.level) == (odometry.status, 0)
    assert "live.points_dropped" in {pair.key for pair in status.values}


class Told:
    """A live odometry that says what a test wants; poses at 200 Hz."""

    def __init__(self):
        self.status, self.counts, self.time, self.n_points = "waiting", {}, 0.0, 10

    def pose(self):
        zeros = np.zeros(3)
        return StampedPose(self.time, zeros, np.array([0.0, 0, 0, 1]), zeros, 0.1)

    def estimate(self):
        return SimpleNamespace(covariances=None)

    def map_points(self):
        return np.zeros((self.n_points, 3), np.float32)


def said_by(told, seconds, change):
    """The topics of what is said in so many seconds; `change` is called before each pose."""
    sent = []
    carrier = SimpleNamespace(advertise=lambda *_: None, publish=lambda *one: sent.append(one))
    says = LiveMessages(told, [carrier], rate=50.0)
    for tick in range(round(200 * seconds)):
        told.time = tick / 200
        change(told)
        says.say(START_NS)
    return sent


def test_poses_come_at_the_rate_and_the_rest_when_there_is_news():
    def grow(told):
        told.status, told.n_points = "tracking", 10 if told.time < 5 else 20

    n = Counter(name for name, _, _ in said_by(Told(), 10.0, grow))
    assert n["/bentwing/odometry"] == n["/tf"]
    assert 400 < n["/tf"] <= 500
    assert (n["/bentwing/path"], n["/diagnostics"], n["/bentwing/map_points"]) == (10, 10, 2)


def test_a_change_of_the_status_is_said_at_once():
    def degrade(told):
        told.status = "waiting" if told.time < 1 else "tracking" if told.time < 2.5 else "coasting"

    stamps = [
        (stamp_ns - START_NS) / 1e9 for name, _, stamp_ns in said_by(Told(), 3.0, degrade)
        if name == "/diagnostics"
    ]  # fmt: skip
    assert stamps == [0.0, 1.0, 2.0, 2.5]


def test_a_large_map_is_thinned():
    def large(told):
        told.status, told.n_points = "tracking", 3 * MOST_POINTS + 1

    types = RosMessages().types
    clouds = [raw for name, raw, _ in said_by(Told(), 1.0, large) if name == "/bentwing/map_points"]
    (width,) = (types.deserialize_cdr(raw, "sensor_msgs/msg/PointCloud2").width for raw in clouds)
    assert 0.7 * MOST_POINTS < width <= MOST_POINTS


def test_a_missing_package_is_named_with_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(UsageError, match="pip install foxglove-sdk"):
        FoxgloveServer(0)


def test_a_port_that_is_taken_is_refused_with_what_to_do(server):
    with pytest.raises(UsageError, match="give another port"):
        FoxgloveServer(server.port)


def test_it_is_heard_on_this_computer_only_unless_asked(server):
    addresses = [line.split()[1] for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
    listening = [one for one in addresses if int(one.rpartition(":")[2], 16) == server.port]
    assert set(listening) == {f"0100007F:{server.port:04X}"}
