# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where beams truly point to, by the walls of a room that a turning lidar sees."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.estimate import Estimate
from bentwing.base.mount import FixedMount, Pose
from bentwing.base.trajectory import Trajectory
from bentwing.closing.beams import FoundBeams, find_beams
from bentwing.closing.beams.shots import sample_shots
from bentwing.recording import LidarBatch, Payload
from bentwing.recording.beam_reading import directed, in_beams
from bentwing.recording.sections.beams import Beams

N_BEAMS, SPAN, RATE = 8, 6.0, 3000.0
ELEVATIONS = np.radians(np.linspace(-35.0, 35.0, N_BEAMS))
HALF_ROOM = np.array([7.0, 5.0, 3.0])
SIGMA = 0.01


def _estimate(tilt: float = 0.4) -> Estimate:
    times = np.arange(0.0, SPAN + 0.5, 0.01)
    phase = 2 * np.pi * times / 4.0
    positions = np.column_stack([2.5 * np.sin(phase), 1.5 * np.cos(phase), 0.5 * np.sin(2 * phase)])
    tilts = np.column_stack([tilt * np.sin(1.3 * phase), tilt * np.cos(0.9 * phase), 0.5 * phase])
    mount = FixedMount(Pose.identity())
    calibration = Calibration(0.0, mount, np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 9.8]))
    return Estimate(Trajectory(times, positions, geometry.exp(tilts)), calibration)


def _batch(estimate: Estimate, errors: np.ndarray, bump: float = 0.0) -> LidarBatch:
    """Returns from walls with bumps, m, recorded without what the beams are off, (B, 4)."""
    rng = np.random.default_rng(7)
    times = np.arange(0.0, SPAN, 1.0 / RATE)
    rings = np.arange(len(times)) % N_BEAMS
    elevation, azimuth, distance, height = errors[rings].T
    turned = np.mod(2 * np.pi * 10.0 * times, 2 * np.pi) - np.pi
    one = np.ones(len(times))
    local = directed(one, ELEVATIONS[rings] + elevation, turned + azimuth, 0.0)
    positions, quats = estimate.trajectory.interpolate(times)
    rays = geometry.rotate(quats, local)
    starts = positions + geometry.rotate(quats, height[:, None] * np.array([0.0, 0.0, 1.0]))
    ranges = ((np.sign(rays) * HALF_ROOM - starts) / rays).min(axis=1)
    hits = starts + ranges[:, None] * rays
    ranges += bump * np.sin(3.0 * hits).prod(axis=1)
    ranges += rng.normal(0.0, SIGMA, len(ranges)) - distance
    recorded = directed(ranges, ELEVATIONS[rings], turned, 0.0)
    return LidarBatch(np.ascontiguousarray(recorded), times, ring=rings.astype(np.uint16))


def _payload() -> Payload:
    return Payload.model_validate({"lidar": {"kind": "vlp16", "range_sigma": SIGMA}})


def _errors() -> np.ndarray:
    rng = np.random.default_rng(11)
    errors = np.zeros((N_BEAMS, 4))
    errors[:, :2] = rng.normal(0.0, np.radians(0.2), (N_BEAMS, 2))
    errors[:, 2] = rng.normal(0.0, 0.02, N_BEAMS)
    # What no motion shows is not in it.
    return errors - errors.mean(axis=0)


def test_errors_of_beams_are_found():
    estimate, errors = _estimate(), _errors()
    found = find_beams(estimate, [_batch(estimate, errors)], _payload())
    assert found is not None
    assert found.matters
    off = found.offsets - errors
    off -= off.mean(axis=0)
    assert np.degrees(np.abs(off[:, :2])).max() < 0.05
    assert np.abs(off[:, 2]).max() < 4e-3
    assert found.roughness[1] < found.roughness[0]
    assert found.table == pytest.approx(ELEVATIONS, abs=1e-6)


def test_two_blocks_of_lasers_at_two_heights_are_found():
    estimate, errors = _estimate(), np.zeros((N_BEAMS, 4))
    errors[:, 3] = np.where(np.arange(N_BEAMS) < N_BEAMS // 2, -0.04, 0.04)
    found = find_beams(estimate, [_batch(estimate, errors)], _payload())
    assert found is not None
    step = found.offsets[N_BEAMS // 2 :, 3].mean() - found.offsets[: N_BEAMS // 2, 3].mean()
    assert step == pytest.approx(0.08, abs=0.01)


def test_ideal_beams_stay_where_they_are():
    estimate = _estimate()
    assert find_beams(estimate, [_batch(estimate, np.zeros((N_BEAMS, 4)))], _payload()) is None


def test_the_bumps_of_a_wall_are_not_errors_of_beams():
    estimate = _estimate(tilt=0.05)
    batch = _batch(estimate, np.zeros((N_BEAMS, 4)), bump=0.15)
    found = find_beams(estimate, [batch], _payload())
    assert found is None or not found.matters


def test_a_lidar_without_beams_says_nothing():
    estimate = _estimate()
    batch = _batch(estimate, np.zeros((N_BEAMS, 4)))
    assert find_beams(estimate, [LidarBatch(batch.points, batch.times)], _payload()) is None


@pytest.mark.parametrize("column", range(4))
def test_slopes_agree_with_central_differences(column):
    estimate = _estimate()
    shots = sample_shots([_batch(estimate, _errors())], estimate)
    still, step = np.zeros((len(shots.times), 3)), np.zeros((N_BEAMS, 4))
    step[:, column] = 1e-6
    ahead, behind = (shots.moved(still, still, s).points() for s in (step, -step))
    assert (ahead - behind) / 2e-6 == pytest.approx(shots.slopes()[column], abs=1e-6)


def test_beams_are_added_to_those_of_the_payload():
    known = Beams(elevations=(1e-3,) * N_BEAMS, table=tuple(ELEVATIONS.tolist()))
    lidar = _payload().lidar.model_copy(update={"beams": known})
    payload = _payload().model_copy(update={"lidar": lidar})
    offsets = np.tile([2e-3, 0.0, 0.01, 0.0], (N_BEAMS, 1))
    found = FoundBeams(offsets, 0.1 * offsets, np.zeros(N_BEAMS), 500, 5000, (0.02, 0.01))
    beams = found.in_payload(payload).lidar.beams
    assert beams.elevations == pytest.approx([3e-3] * N_BEAMS)
    assert beams.ranges == pytest.approx([0.01] * N_BEAMS)
    assert beams.table == known.table


def test_recorded_and_corrected_returns_lie_in_the_walls():
    estimate, errors = _estimate(), _errors()
    batch = _batch(estimate, errors)
    ranges, elevations, azimuths = in_beams(batch.points)
    elevation, azimuth, distance, height = errors[batch.ring].T
    local = directed(ranges + distance, elevations + elevation, azimuths + azimuth, height)
    positions, quats = estimate.trajectory.interpolate(batch.times)
    points = positions + geometry.rotate(quats, local)
    off = np.abs(np.abs(points) - HALF_ROOM).min(axis=1)
    assert np.median(off) < SIGMA
