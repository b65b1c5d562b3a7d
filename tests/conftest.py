# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fixtures of all tests: the shared real data, and recordings written on the spot."""

from __future__ import annotations

import fcntl
import functools
import os
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import hypothesis
import numpy as np
import pytest
from rosbags.rosbag1 import Writer as Rosbag1Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Rosbag2Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from bentwing.simulate import Scenario, simulate

# How long an example takes says more about what else the machine does than about the code.
hypothesis.settings.register_profile("bentwing", deadline=None)
hypothesis.settings.load_profile("bentwing")

pytest_plugins = ["support.skips"]

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared" / "data"
SHARED_CASES = SHARED_DATA.parent / "cases"

LIVOX_POINT = (
    "uint32 offset_time\nfloat32 x\nfloat32 y\nfloat32 z\nuint8 reflectivity\nuint8 tag\nuint8 line"
)
LIVOX_MSG = (
    "std_msgs/Header header\nuint64 timebase\nuint32 point_num\nuint8 lidar_id\nuint8[3] rsvd\n"
    "livox_ros_driver2/CustomPoint[] points"
)
VELODYNE_PACKET = "builtin_interfaces/Time stamp\nuint8[1206] data"
VELODYNE_SCAN = "std_msgs/Header header\nvelodyne_msgs/VelodynePacket[] packets"
HESAI_SCANS = {  # and what they consist of
    "hesai_lidar/msg/PandarScan": "hesai_lidar/msg/PandarPacket",
    "hesai_ros_driver/msg/UdpFrame": "hesai_ros_driver/msg/UdpPacket",
}
RSLIDAR_PACKET = "std_msgs/Header header\nuint8 is_difop\nuint8 is_frame_begin\nuint8[] data"
START = 1_700_000_000  # s, recorder's and header's time of t = 0


@pytest.fixture(scope="session")
def shared_data():
    """Folder of real recordings; tests that need it are skipped where it is absent."""
    if not SHARED_DATA.is_dir():
        pytest.skip(f"real recordings are not at {SHARED_DATA}")
    return SHARED_DATA


@pytest.fixture(scope="session")
def shared_cases():
    """Folder of small real recordings with one fault each; tests are skipped where it is absent."""
    if not SHARED_CASES.is_dir():
        pytest.skip(f"real recordings are not at {SHARED_CASES}")
    return SHARED_CASES


def _store(ros1: bool):
    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    store.register(get_types_from_msg(LIVOX_POINT, "livox_ros_driver2/msg/CustomPoint"))
    store.register(get_types_from_msg(LIVOX_MSG, "livox_ros_driver2/msg/CustomMsg"))
    store.register(get_types_from_msg(VELODYNE_PACKET, "velodyne_msgs/msg/VelodynePacket"))
    store.register(get_types_from_msg(VELODYNE_SCAN, "velodyne_msgs/msg/VelodyneScan"))
    store.register(get_types_from_msg("uint8[] buf", "ouster_ros/msg/PacketMsg"))
    for scan, packet in HESAI_SCANS.items():
        row = "builtin_interfaces/Time stamp\nuint8[] data\nuint32 size"
        store.register(get_types_from_msg(row, packet))
        rows = f"std_msgs/Header header\n{packet.replace('/msg/', '/')}[] packets"
        store.register(get_types_from_msg(rows, scan))
    store.register(get_types_from_msg(RSLIDAR_PACKET, "rslidar_msg/msg/RslidarPacket"))
    if ros1:  # which ROS 2's store has
        tf = "geometry_msgs/TransformStamped[] transforms"
        store.register(get_types_from_msg(tf, "tf2_msgs/msg/TFMessage"))
    return store


STORES = {ros1: _store(ros1) for ros1 in (True, False)}


class Messages:
    """Messages of one ROS version; times in s after START."""

    def __init__(self, ros1: bool) -> None:
        self.ros1 = ros1
        self.store = STORES[ros1]
        self.types = self.store.types

    def serialize(self, message: Any) -> bytes:
        kind = message.__msgtype__
        if self.ros1:
            return bytes(self.store.serialize_ros1(message, kind))
        return bytes(self.store.serialize_cdr(message, kind))

    def header(self, t: float | None, frame: str = "sensor"):
        stamp_ns = 0 if t is None else START * 10**9 + round(t * 1e9)
        stamp = self.types["builtin_interfaces/msg/Time"](*divmod(stamp_ns, 10**9))
        first = {"seq": 0} if self.ros1 else {}
        return self.types["std_msgs/msg/Header"](**first, stamp=stamp, frame_id=frame)

    def scan(self, t, ranges=None, *, frame="sensor", time_increment=1e-5, **values):
        ranges = np.full(100, 5.0) if ranges is None else ranges
        defaults = {
            "angle_min": -1.0, "angle_max": 1.0, "angle_increment": 0.02, "scan_time": 0.025,
            "range_min": 0.1, "range_max": 30.0, "intensities": np.zeros(0, np.float32),
        }  # fmt: skip
        return self.types["sensor_msgs/msg/LaserScan"](
            header=self.header(t, frame),
            ranges=np.asarray(ranges, np.float32),
            time_increment=time_increment,
            **(defaults | values),
        )

    def multi_echo(self, t, echoes, strengths):
        echo = self.types["sensor_msgs/msg/LaserEcho"]
        return self.types["sensor_msgs/msg/MultiEchoLaserScan"](
            self.header(t), -1.0, 1.0, 0.02, 1e-5, 0.025, 0.1, 30.0,
            [echo(np.array(e, np.float32)) for e in echoes],
            [echo(np.array(s, np.float32)) for s in strengths],
        )  # fmt: skip

    def imu(self, t, gyro=(0.0, 0.0, 0.0), accel=(0.0, 0.0, 9.81), *, frame="imu"):
        vector = self.types["geometry_msgs/msg/Vector3"]
        still = self.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0)
        zeros = np.zeros(9)
        return self.types["sensor_msgs/msg/Imu"](
            self.header(t, frame), still, zeros, vector(*map(float, gyro)), zeros,
            vector(*map(float, accel)), zeros,
        )  # fmt: skip

    def joint(self, t, angle, *, names=("motor",)):
        empty = np.zeros(0)
        return self.types["sensor_msgs/msg/JointState"](
            self.header(t), list(names), np.atleast_1d(np.array(angle, float)), empty, empty
        )

    def tf(self, t, *links):
        """TFMessage of (parent, child, translation, quaternion x y z w)."""
        vector, quat = (self.types[f"geometry_msgs/msg/{n}"] for n in ("Vector3", "Quaternion"))
        pose = self.types["geometry_msgs/msg/Transform"]
        stamped = self.types["geometry_msgs/msg/TransformStamped"]
        rows = [
            stamped(
                self.header(t, parent), child, pose(vector(*map(float, p)), quat(*map(float, q)))
            )
            for parent, child, p, q in links
        ]
        return self.types["tf2_msgs/msg/TFMessage"](rows)

    def cloud(self, t, table: np.ndarray, *, row_step=None, data=None, height=1, frame="lidar"):
        """PointCloud2 of a structured array."""
        codes = {"i1": 1, "u1": 2, "i2": 3, "u2": 4, "i4": 5, "u4": 6, "f4": 7, "f8": 8}
        field = self.types["sensor_msgs/msg/PointField"]
        fields = [
            field(name, offset, codes.get(dtype.str[1:], 0), 1)
            for name, (dtype, offset, *_) in table.dtype.fields.items()
        ]
        big = any(dtype.str[0] == ">" for dtype, *_ in table.dtype.fields.values())
        data = table.tobytes() if data is None else data
        width = len(table) // height
        return self.types["sensor_msgs/msg/PointCloud2"](
            self.header(t, frame), height, width, fields, big, table.dtype.itemsize,
            table.dtype.itemsize * width if row_step is None else row_step,
            np.frombuffer(data, np.uint8), True,
        )  # fmt: skip

    def livox(self, t, offsets_ns, points):
        point = self.types["livox_ros_driver2/msg/CustomPoint"]
        rows = [
            point(int(o), *map(float, p), 7, 0, i % 4)
            for i, (o, p) in enumerate(zip(offsets_ns, points, strict=True))
        ]
        timebase = START * 10**9 + round(t * 1e9)
        return self.types["livox_ros_driver2/msg/CustomMsg"](
            self.header(t), timebase, len(rows), 0, np.zeros(3, np.uint8), rows
        )

    def velodyne_scan(self, t, packets):
        """VelodyneScan of (time in s or None, bytes)."""
        packet = self.types["velodyne_msgs/msg/VelodynePacket"]
        rows = [packet(self.header(s).stamp, np.frombuffer(data, np.uint8)) for s, data in packets]
        return self.types["velodyne_msgs/msg/VelodyneScan"](self.header(t), rows)

    def hesai_scan(self, kind, t, packets):
        """Scan of one of Hesai's drivers, whose rows are as long as its buffer."""
        row = self.types[HESAI_SCANS[kind]]
        stamp = self.header(t).stamp
        rows = [
            row(stamp, np.frombuffer(data.ljust(1500, b"\0"), np.uint8), len(data))
            for data in packets
        ]
        return self.types[kind](self.header(t), rows)

    def rslidar_packet(self, t, data, *, is_device):
        packet = self.types["rslidar_msg/msg/RslidarPacket"]
        return packet(self.header(t), int(is_device), 0, np.frombuffer(data, np.uint8))

    def ouster_packet(self, data: bytes):
        return self.types["ouster_ros/msg/PacketMsg"](np.frombuffer(data, np.uint8))

    def string(self, text: str):
        return self.types["std_msgs/msg/String"](text)

    def write(self, path: Path, entries, *, kind: str = "bag") -> Path:
        """Write (topic, recorder's time in s, message) to a bag; kind bag, mcap or db3."""
        plugin = StoragePlugin.MCAP if kind == "mcap" else StoragePlugin.SQLITE3
        writer = (
            Rosbag1Writer(path)
            if self.ros1
            else Rosbag2Writer(path, version=9, storage_plugin=plugin)
        )
        with writer:
            connections = {}
            for topic, t, message in entries:
                kind_ = message if isinstance(message, str) else message.__msgtype__
                if topic not in connections:
                    connections[topic] = writer.add_connection(topic, kind_, typestore=self.store)
                if isinstance(message, str):
                    continue
                stamp_ns = START * 10**9 + round(t * 1e9)
                writer.write(connections[topic], stamp_ns, self.serialize(message))
        return path


@pytest.fixture(scope="session")
def ros1():
    return Messages(ros1=True)


@pytest.fixture(scope="session")
def ros2():
    return Messages(ros1=False)


@pytest.fixture(scope="session", params=[True, False], ids=["ros1", "ros2"])
def ros(request):
    return Messages(ros1=request.param)


@pytest.fixture(scope="session")
def head_entries():
    """Return a maker of a spinning 2D head's entries: scans, IMU, and optionally an encoder."""

    def make(messages: Messages, duration=2.0, *, encoder=False, spin=4.0):
        entries = []
        for i in range(round(duration * 40)):
            t = i / 40
            entries.append(("/scan", t, messages.scan(t)))
        for i in range(round(duration * 200)):
            t = i / 200
            angle = spin * t
            down = (9.81 * np.sin(angle), 0.0, 9.81 * np.cos(angle))
            entries.append(("/imu", t, messages.imu(t, (0.0, -spin, 0.0), down)))
            if encoder:
                wrapped = (angle + np.pi) % (2 * np.pi) - np.pi
                entries.append(("/encoder", t, messages.joint(t, wrapped)))
        return sorted(entries, key=lambda entry: entry[1])

    return make


@pytest.fixture(scope="session")
def made_once(tmp_path_factory):
    """Return a maker of folders that are filled once, also where several workers want them."""
    base = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        base = base.parent

    def made(name, fill):
        folder, finished = base / name, base / f"{name}.finished"
        with locked(base / f"{name}.lock"):
            if not finished.exists():
                fill(folder)
                finished.touch()
        return folder

    return made


@contextmanager
def locked(path):
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


@pytest.fixture(scope="session")
def simulated(made_once):
    """Return a maker of simulated recordings: the folder with recording, payload and truth."""

    @functools.cache
    def make(
        scene,
        duration,
        *,
        seed=0,
        flight_seed=None,
        head="hokuyo-spin",
        events=(),
        realism=0.0,
        only=(),
    ):
        flight = [] if flight_seed is None else [f"flight{flight_seed}"]
        harsh = [f"realism{realism:g}", *only] if realism else []
        name = "-".join(["sim", scene, head, f"{duration:g}", str(seed), *flight, *events, *harsh])
        scenario = Scenario(
            scene=scene,
            head=head,
            duration=duration,
            seed=seed,
            flight_seed=flight_seed,
            events=events,
            realism=realism,
            realism_only=only,
        )
        return made_once(name, lambda folder: simulate(scenario, folder))

    return make
