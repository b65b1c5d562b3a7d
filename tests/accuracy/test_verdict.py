# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a run knows when it is wrong: a good flight, and the same with one thing wrong."""

from __future__ import annotations

import pytest

from bentwing import map_recording
from bentwing.simulate.faults import with_fault

# With the kind of evidence that speaks for the cause, of several the first.
FAULTS = {
    "mount-90-x": {"matches", "lost"},
    "mount-wxyz": {"matches", "lost", "accelerometer"},
    "gyro-swapped": {"matches", "lost"},
    "gyro-zero": {"constant"},
    "gyro-1.2": {"matches", "lost", "calibration"},
    "accel-swapped": {"accelerometer"},
    "imu-frozen": {"repeated"},
    "imu-10hz": {"imu_period"},
    "elevator": {"accelerometer"},
    "lidar-late-0.5": {"matches"},
    "ranges-1.3": {"scale"},
    "ranges-random": {"scatter"},
    "ranges-constant": {"even_ranges"},
}


@pytest.fixture(scope="module")
def flight(simulated):
    return simulated("office", 22.0)


def test_a_good_flight_is_called_good(flight, tmp_path):
    run = map_recording(
        flight / "recording.bag", flight / "payload.yaml", tmp_path, map_spacing=0.1
    )
    assert (run.verdict.state, run.verdict.reasons) == ("good", ())


@pytest.mark.slow
@pytest.mark.parametrize("fault", FAULTS)
def test_a_flight_with_one_thing_wrong_is_not_called_good(flight, tmp_path, fault):
    bag, payload = flight / "recording.bag", flight / "payload.yaml"
    with_fault(bag, payload, fault, tmp_path, seed=3)
    run = map_recording(
        tmp_path / "recording.bag",
        tmp_path / "payload.yaml",
        tmp_path / "run",
        map_spacing=0.1,
        trust_payload=True,
        force=True,
    )
    assert run.verdict.state != "good"
    assert run.verdict.reasons[0].kind in FAULTS[fault]
    assert {path.name for path in (tmp_path / "run").iterdir()} >= {
        "trajectory.txt", "odometry.txt", "map.laz", "report.html", "run.json"
    }  # fmt: skip
