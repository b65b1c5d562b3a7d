# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing live --ros2` beside another participant of DDS, on this machine."""

from __future__ import annotations

import importlib.util
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.base.trajectory import read_tum
from bentwing.flight.ros2 import dds_types
from bentwing.recording import Payload
from bentwing.simulate import Scenario, simulate

needs_dds = pytest.mark.skipif(
    importlib.util.find_spec("cyclonedds") is None, reason='needs pip install "bentwing[ros2]"'
)
PARTICIPANT = Path(__file__).parents[1] / "support" / "ros2_participant.py"
# A domain of its own, so that neither robots nor other workers of the tests are heard.
DOMAIN = 100 + os.getpid() % 100
LOOPBACK = "<CycloneDDS><Domain><General><Interfaces><NetworkInterface name='lo' multicast='true'/></Interfaces></General></Domain></CycloneDDS>"


def started(*command):
    environment = os.environ | {"CYCLONEDDS_URI": LOOPBACK}
    pipe = subprocess.PIPE
    return subprocess.Popen([sys.executable, *map(str, command)], stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment)  # fmt: skip


@needs_dds
@pytest.mark.slow
def test_odometry_is_heard_by_another_participant_and_follows_the_truth(tmp_path):
    scenario = Scenario(scene="courtyard", head="vlp16-fixed", duration=25.0, seed=903)
    files = simulate(scenario, tmp_path / "flight")
    head = Payload.load(files.payload)
    other = started(PARTICIPANT, files.recording, DOMAIN, head.lidar.topic, head.imu.topic)
    out = tmp_path / "live.txt"
    try:
        assert other.stdout.readline() == "ready\n", other.stderr.read()
        live = started(
            "-m", "bentwing", "live", "--ros2", "-p", files.payload, "--domain", DOMAIN, "-o", out,
            "--estimator", "kalman",
        )  # fmt: skip
        try:
            lines = iter(live.stdout.readline, "")
            assert next(lines).split() == ["lidar", head.lidar.topic]
            assert next(lines).split() == ["imu", head.imu.topic]
            heard, problem = other.communicate("\n", timeout=120)
            assert not other.returncode, problem
            live.send_signal(signal.SIGINT)
            said, problem = live.communicate(timeout=120)
            assert not live.returncode, problem
        finally:
            live.kill()
    finally:
        other.kill()
    assert "tracking" in said
    found = json.loads(heard.splitlines()[-1])
    assert found["tf"][0] == ["map", found["odometry"][0][2]]
    assert found["paths"]
    assert sorted(found["paths"]) == found["paths"]
    assert sorted(found["maps"]) == found["maps"]
    assert found["maps"][-1] > 5000
    assert found["statuses"][-1] == "tracking"
    stamps = np.array([row[0] for row in found["odometry"]])
    assert len(stamps) > 100
    assert (np.diff(stamps) > 0).all()
    assert {row[1] for row in found["odometry"]} == {"map"}
    covariance = np.array(found["odometry"][-1][4]).reshape(6, 6)
    assert np.linalg.eigvalsh(covariance).min() > 0
    truth, _ = read_tum(files.trajectory, int(stamps[0]))
    kept, _ = read_tum(out, int(stamps[0]))
    times = (stamps - stamps[0]) * 1e-9
    settled = times > times[-1] - 5.0
    poses = np.array([row[3] for row in found["odometry"]])
    assert aligned_error(truth, times[settled], poses[settled, :3]) < 0.1
    inside = (kept.times > 2) & (kept.times < truth.times[-1])
    assert aligned_error(truth, kept.times[inside], kept.positions[inside]) < 0.1


def aligned_error(truth, times, positions):
    """Root mean square distance from the truth, m, once both are put on each other."""
    there = np.column_stack([np.interp(times, truth.times, axis) for axis in truth.positions.T])
    a, b = positions - positions.mean(axis=0), there - there.mean(axis=0)
    u, _, vt = np.linalg.svd(a.T @ b)
    rotation = u @ np.diag([1, 1, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(((a @ rotation - b) ** 2).sum(axis=1).mean()))


@needs_dds
@pytest.mark.parametrize("kind", ["sensor_msgs/msg/PointCloud2", "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Imu", "sensor_msgs/msg/JointState", "nav_msgs/msg/Path"])  # fmt: skip
def test_the_types_of_messages_have_the_names_that_ros_gives_them_in_dds(kind):
    package, _, name = kind.partition("/msg/")
    made = dds_types.dds_type(kind)
    assert made.__idl_typename__ == f"{package}::msg::dds_::{name}_"
    assert dds_types.kind_of(dds_types.type_name(kind)) == kind
    assert dds_types.raw_sample(kind, b"\0\1\0\0").serialize() == b"\0\1\0\0"
    assert made.deserialize(b"\0\1\0\0").raw == b"\0\1\0\0"


def test_a_missing_package_is_named_with_how_to_install_it(monkeypatch):
    monkeypatch.setitem(sys.modules, "cyclonedds", None)
    with pytest.raises(UsageError, match="pip install cyclonedds"):
        dds_types.require_dds()
