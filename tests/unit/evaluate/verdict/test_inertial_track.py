# SPDX-License-Identifier: MIT OR Apache-2.0
"""How an IMU moved by its own samples, whatever pieces they come in and whatever hits its housing."""

import numpy as np
import pytest

from bentwing.evaluate.verdict.inertial_track import InertialTrack
from bentwing.recording.batches import ImuBatch

TIMES = np.arange(0.0, 6.0, 0.005)


def samples(*, blow: bool) -> ImuBatch:
    """A slow sway, and rotors; a blow rings for 0.017 s with 12 g, cut off at 8 g."""
    accel = np.stack([np.sin(TIMES), 0.3 * np.cos(TIMES), np.full_like(TIMES, 9.81)], axis=1)
    accel[:, 2] += 1.5 * np.sin(2 * np.pi * 90.0 * TIMES)
    if blow:
        since = (TIMES - 3.0013) / 0.017
        inside = (since > 0) & (since < 1)
        accel[inside, 0] += 118.0 * np.sin(2 * np.pi * since[inside])
    gyro = np.stack([np.cos(TIMES), np.zeros_like(TIMES), np.full_like(TIMES, 5.0)], axis=1)
    return ImuBatch(TIMES, gyro, np.clip(accel, -78.0, 78.0))


def track_of(batch: ImuBatch, size: int) -> InertialTrack:
    track = InertialTrack()
    for first in range(0, len(batch.times), size):
        part = slice(first, first + size)
        track.add(ImuBatch(batch.times[part], batch.gyro[part], batch.accel[part]))
    return track


@pytest.mark.parametrize("size", [1, 7, 400, 5000])
def test_a_blow_to_the_housing_is_no_motion_in_whatever_pieces_it_comes(size):
    at = np.arange(0.0, 6.0, 0.5)
    rates, forces = track_of(samples(blow=False), 5000).means(at)
    same_rates, same_forces = track_of(samples(blow=True), size).means(at)
    assert np.allclose(same_rates, rates, atol=1e-9)
    assert np.abs(same_forces - forces).max() < 0.02
    felt = samples(blow=True).accel - samples(blow=False).accel
    assert np.abs(felt.sum(axis=0) * 0.005 / 0.5).max() > 0.08


def test_the_integrals_end_with_the_newest_sample_and_go_on_from_there():
    batch = samples(blow=False)
    track = track_of(ImuBatch(*(a[:600] for a in (batch.times, batch.gyro, batch.accel))), 100)
    assert track.table[-1, 0] == pytest.approx(TIMES[599], abs=0.011)
    track.add(ImuBatch(*(a[600:] for a in (batch.times, batch.gyro, batch.accel))))
    assert np.allclose(track.table, track_of(batch, 5000).table, atol=1e-9)
