# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ctrl-C while a recording is being mapped."""

import json
import signal
import subprocess
import sys

import pytest

from bentwing.base.trajectory import read_tum

# What `bentwing` does, telling when a window has been registered.
SCRIPT = """
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job ignores it
from bentwing.odometry.continuous.odometry_pass import OdometryPass
step = OdometryPass.step
def told(self, *arguments):
    step(self, *arguments)
    print("window", flush=True)
OdometryPass.step = told
sys.argv = ["bentwing", "map", *sys.argv[1:]]
from bentwing.cli.main import run
run()
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    folder = tmp_path_factory.mktemp("interrupt")
    command = [sys.executable, "-m", "bentwing", "simulate", "courtyard", "--duration", "20"]
    subprocess.run([*command, "-o", folder / "rec"], check=True, capture_output=True)
    return folder / "rec"


def test_an_interrupted_run_ends_and_keeps_its_trajectory(recording, tmp_path):
    out = tmp_path / "run"
    arguments = [recording / "recording.bag", "--payload", recording / "payload.yaml", "-o", out]
    process = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    for _ in range(4):
        assert process.stdout.readline() == "window\n"
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130
    assert err.endswith("bentwing: error: interrupted\n")
    record = json.loads((out / "run.json").read_text())
    assert (record["complete"], record["stage"]) == (False, "estimate")
    assert record["reason"] == "interrupted"
    assert record["files"] == ["odometry.txt", "report.html"]
    assert len(record["windows"]) >= 4
    trajectory, _ = read_tum(out / "odometry.txt")
    assert trajectory.times[-1] > 3.0
    assert "Incomplete" in (out / "report.html").read_text()
