# SPDX-License-Identifier: MIT OR Apache-2.0
"""What goes wrong in the field: the estimate lives on, and the user is told."""

from __future__ import annotations

import numpy as np

from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.evaluate.simulated import score
from bentwing.evaluate.trajectory import absolute_error
from bentwing.run.pipeline import map_recording

SCENE, DURATION = "office", 22.0
GAP = (0.6 * DURATION, 0.6 * DURATION + 1.5)  # s


def fly(flown, *events):
    return flown(SCENE, DURATION, events=events)


def sentences(flight):
    return "\n".join(flight.record["warnings"])


def test_a_payload_that_stands_still_and_lost_scans_are_survived(flown):
    """Four seconds without turn, and bursts of up to 0.15 s of scans that never arrive."""
    flight = fly(flown, "spin-stall", "dropped-packets")
    assert flight.record["complete"]
    assert flight.score.ate_flight < 0.005
    assert flight.score.map_ratio < 1.2
    assert abs(flight.score.latency) < 0.5e-3


def test_a_gap_costs_no_more_than_itself(flown):
    """Nobody knows the way through 1.5 s without any sensor; before and after it must agree."""
    flight = fly(flown, "gap")
    truth, origin_ns = read_tum(flight.recording / "truth_trajectory.txt")
    estimate, _ = read_tum(flight.out / "trajectory.txt", origin_ns)
    inside = (truth.times > GAP[0] - 0.5) & (truth.times < GAP[1] + 0.5)
    away = np.linalg.norm(truth.positions - truth.positions[0], axis=1) > 0.1
    kept = ~inside & away
    known = Trajectory(truth.times[kept], truth.positions[kept], truth.quats_xyzw[kept])
    error = absolute_error(estimate, known)
    assert error.position.rmse < 0.005
    assert error.position.maximum < 0.015


def test_a_gap_is_told_with_its_length_and_place(flown):
    text = sentences(fly(flown, "gap"))
    for topic in ("/scan", "/imu"):
        assert f"{topic}: 1 gap(s): 1.5 s from" in text
    assert "no inertial data from 13.2" in text
    assert "fits together" in text


def test_a_start_in_motion_still_gives_a_map(flown):
    """The attitude comes from the mean force of the first second, the velocity from the first windows."""
    flight = fly(flown, "motion-start")
    assert flight.record["complete"]
    assert flight.score.ate_flight < 0.005
    assert abs(flight.score.latency) < 1e-3
    assert flight.record["counts"]["map.points"] > 100_000


def test_a_recording_that_begins_in_motion_is_as_accurate(simulated, tmp_path):
    """A head that nods when the recording begins: nothing is known of the IMU but what is described."""
    folder = simulated("courtyard", DURATION, head="hokuyo-nod")
    run = tmp_path / "run"
    map_recording(folder / "recording.bag", folder / "payload.yaml", run, start=8.0)
    found = score(folder, run)
    assert found.ate < 0.005
    assert found.map_ratio < 1.2
