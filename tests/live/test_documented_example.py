# SPDX-License-Identifier: MIT OR Apache-2.0
"""The example in the documentation and the one in examples/ do what they say."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


@pytest.fixture
def replay(simulated):
    """Run the example on a flight of 22 s, at its speed; returns what it prints."""
    folder = simulated("office", 22.0)

    def run(*options):
        script = ROOT / "examples" / "live_replay.py"
        files = [folder / "recording.bag", "--payload", folder / "payload.yaml"]
        answer = subprocess.run(
            [sys.executable, script, *files, *options], check=False, capture_output=True, text=True
        )
        assert answer.returncode == 0, answer.stderr
        return answer.stdout

    return run


def test_the_documented_example_runs(simulated, tmp_path, monkeypatch, capsys):
    folder = simulated("office", 22.0)
    for name in ("recording.bag", "payload.yaml"):
        (tmp_path / name).symlink_to(folder / name)
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "docs" / "live.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert len(blocks) == 1
    exec(compile(blocks[0], "docs/live.md", "exec"), {})
    assert len((tmp_path / "trajectory.txt").read_text().splitlines()) > 2000
    printed = capsys.readouterr().out
    assert "initializing" in printed
    assert re.search(r"\d{5} points, latency", printed)


def test_the_example_prints_latencies_and_errors(replay, simulated):
    truth = simulated("office", 22.0) / "truth_trajectory.txt"
    printed = replay("--no-viewer", "--reference-trajectory", truth)
    for row in (
        "first pose",
        "one call of pose()",
        "age of the newest window",
        "error of the pose",
    ):
        assert row in printed


def test_the_example_saves_what_rerun_can_open(replay, tmp_path):
    pytest.importorskip("rerun", reason="the extra `view` is not installed")
    path = tmp_path / "live.rrd"
    replay("--save", path)
    answer = {
        command: subprocess.run(
            [sys.executable, "-m", "rerun", "rrd", command, path],
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for command in ("verify", "stats")
    }
    for entity in ("/map/points/0", "/map/way", "/map/imu", "/status"):
        assert entity in answer["stats"]
