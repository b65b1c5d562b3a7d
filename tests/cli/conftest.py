# SPDX-License-Identifier: MIT OR Apache-2.0
"""Commands as a user runs them, and recordings in which one thing is wrong."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
import yaml
from rosbags.rosbag1 import Reader, Writer

import bentwing.run.flights  # binds run_recording before a test replaces it
from bentwing.cli.main import run_command


@pytest.fixture
def bentwing(capfd):
    """Run a command in this process; return its exit code and what it said."""

    def run(*arguments):
        capfd.readouterr()
        code = run_command([str(argument) for argument in arguments])
        out, err = capfd.readouterr()
        assert "Traceback" not in out + err
        assert "panicked" not in err
        return SimpleNamespace(code=code, out=out, err=err)

    return run


@pytest.fixture(scope="session")
def office(simulated):
    """A flight of 22 s through an office: recording.bag, payload.yaml and the truth."""
    return simulated("office", 22.0)


@pytest.fixture
def changed_payload(office, tmp_path):
    """Write the office's payload with some sections replaced; None removes one."""

    def write(**sections):
        payload = yaml.safe_load((office / "payload.yaml").read_text())
        payload.update(sections)
        path = tmp_path / "payload.yaml"
        path.write_text(yaml.safe_dump({k: v for k, v in payload.items() if v is not None}))
        return path

    return write


@pytest.fixture
def changed_bag(office, tmp_path, ros1):
    """Write the office's recording with its messages changed.

    `change(topic, t, message)` receives the recorder's time since the start in s and returns what is
    written instead: pairs of a time and a message.
    """

    def write(change, *, until=22.0, name="changed.bag"):
        path = tmp_path / name
        with Reader(office / "recording.bag") as reader, Writer(path) as writer:
            new = {
                c.topic: writer.add_connection(c.topic, c.msgtype, typestore=ros1.store)
                for c in reader.connections
            }
            for connection, stamp, raw in reader.messages():
                t = 1e-9 * (stamp - reader.start_time)
                if t > until:
                    break
                message = ros1.store.deserialize_ros1(raw, connection.msgtype)
                for at, other in change(connection.topic, t, message):
                    stamp_ns = reader.start_time + round(1e9 * at)
                    writer.write(new[connection.topic], stamp_ns, ros1.serialize(other))
        return path

    return write


@pytest.fixture
def shifted(ros1):
    """Move the stamp of a message by some seconds."""
    time = ros1.types["builtin_interfaces/msg/Time"]

    def shift(message, seconds):
        stamp = message.header.stamp
        total = stamp.sec * 10**9 + stamp.nanosec + round(1e9 * seconds)
        message.header.stamp = time(*divmod(total, 10**9))
        return message

    return shift
