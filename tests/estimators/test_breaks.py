# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings in which sensors fall silent: bridged where the surroundings tell, else cut in two."""

from __future__ import annotations

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import odometry
from bentwing.base import geometry
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.trajectory import absolute_error
from bentwing.flight.live.prediction import Prediction
from bentwing.odometry.start import levelling
from bentwing.recording import ImuBatch, LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess


@pytest.fixture(scope="module")
def flight(simulated):
    """The payload, the batches and the truth of a flight through an office."""
    folder = simulated("office", 22.0)
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        batches = list(preprocess(recording.batches(), payload, Counter()))
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
    return SimpleNamespace(payload=payload, batches=batches, truth=truth)


@pytest.fixture
def mapped(flight):
    """The estimate of the flight without what some sensors saw from `start` to `stop` s."""

    def estimate(start, stop, *silent):
        engine = odometry.create("continuous", flight.payload, None, 2)
        flight.engine = engine
        for batch in flight.batches:
            if isinstance(batch, silent):
                batch = batch.where((batch.times < start) | (batch.times > stop))
            engine.feed(batch)
        return engine.result()

    return estimate


def error(flight, estimate, span):
    """Root mean square of the position of one segment, aligned by itself, m."""
    return absolute_error(estimate.trajectory, flight.truth.within([span])).position.rmse


def test_what_cannot_be_bridged_is_cut_in_two(flight, mapped):
    estimate = mapped(8.0, 15.0, LidarBatch, ImuBatch)
    first, second = estimate.segments
    assert first[1] == pytest.approx(8.0, abs=0.1)
    assert second[0] == pytest.approx(15.0, abs=0.1)
    assert error(flight, estimate, first) < 0.006
    assert error(flight, estimate, second) < 0.006
    assert np.diff(estimate.trajectory.times) == pytest.approx(0.01)
    (sentence,) = [w for w in estimate.warnings if "begins anew" in w]
    assert "from 8.00 to 15.0" in sentence


def test_live_poses_behind_a_break_are_those_of_the_estimate(flight, mapped):
    estimate = mapped(8.0, 15.0, LidarBatch, ImuBatch)
    newest = flight.engine.current.registered
    recent = Prediction(newest).recent
    within = slice(2, -1)  # the first sample is interpolated over the break
    positions, quats = estimate.trajectory.interpolate(recent.times[within])
    assert np.abs(recent.positions[within] - positions).max() < 2e-4
    assert np.abs(recent.quats_xyzw[within] - quats).max() < 1e-3
    # Levelled about the origin they would be elsewhere.
    first, tilt = newest.samples.positions[0], levelling(newest.globals.gravity)
    assert np.linalg.norm(geometry.rotate(tilt, first) - first) > 4e-4


def test_a_second_without_imu_is_bridged_by_what_the_lidar_sees(flight, mapped):
    estimate = mapped(12.0, 13.0, ImuBatch)
    assert len(estimate.segments) == 1
    assert error(flight, estimate, estimate.segments[0]) < 0.006
    assert any("fits together" in w for w in estimate.warnings)


def test_the_imu_carries_six_seconds_without_lidar(flight, mapped):
    estimate = mapped(9.0, 15.0, LidarBatch)
    assert len(estimate.segments) == 1
    outside = [(0.0, 9.0), (15.5, 22.0)]
    seen = absolute_error(estimate.trajectory, flight.truth.within(outside))
    assert seen.position.rmse < 0.006


def test_an_imu_that_ends_ends_the_trajectory(mapped):
    estimate = mapped(12.0, np.inf, ImuBatch)
    assert estimate.trajectory.times[-1] == pytest.approx(12.2, abs=0.3)
    assert any("before the lidar's" in w for w in estimate.warnings)
