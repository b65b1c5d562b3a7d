# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from bentwing.recording import ImuBatch
from bentwing.recording.preprocess.imu_limits import ImuLimits

RATE_HZ = 200.0
LIMIT = 0.5


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.fixture
def swing(rng) -> ImuBatch:
    """Twenty seconds of swings of 1 s and up to 0.6 rad/s about y, with the noise of a sensor."""
    times = np.arange(0.0, 20.0, 1 / RATE_HZ)
    gyro = rng.normal(0.0, 0.003, (len(times), 3))
    accel = rng.normal([0.0, 0.0, 9.8], 0.05, (len(times), 3))
    gyro[:, 1] += 0.6 * np.sin(2 * np.pi * times)
    return ImuBatch(times, gyro, accel)


def clipped(batch: ImuBatch, limit: float = LIMIT) -> ImuBatch:
    return ImuBatch(batch.times, np.clip(batch.gyro, -limit, limit), batch.accel)


def marks(batch: ImuBatch, size: int = 20) -> tuple[np.ndarray, Counter[str]]:
    """Axes at their limit (M, 6), batch by batch, and what was counted."""
    counts = Counter[str]()
    limits, found = ImuLimits(counts), []
    for first in range(0, len(batch.times), size):
        part = batch.where(slice(first, first + size))
        marked = limits.marked(part)
        none = np.zeros((len(part.times), 6), np.bool_)
        found.append(none if marked.at_limit is None else marked.at_limit)
    return np.concatenate(found), counts


def test_what_has_no_limit_stays_the_very_batch(swing):
    counts = Counter[str]()
    assert ImuLimits(counts).marked(swing) is swing
    assert not counts


@pytest.mark.parametrize("size", [1, 20, 300])
def test_samples_at_a_limit_are_marked_from_the_first_stretch_on(swing, size):
    batch = clipped(swing)
    found, counts = marks(batch, size)
    at_limit = np.abs(batch.gyro[:, 1]) == LIMIT
    # Each end shows in its first stretch, of a sixth of a second.
    assert np.array_equal(found[:, 1][batch.times > 1.0], at_limit[batch.times > 1.0])
    assert not found[:, [0, 2, 3, 4, 5]].any()
    assert counts == {"preprocess.gyro_at_limit": found[:, 1].sum()}


def test_a_blow_to_the_accelerometer_leaves_the_gyro_as_it_is(swing):
    ring = np.sin(2 * np.pi * np.arange(8) / 8) * 150.0
    accel = swing.accel.copy()
    for first in (1000, 3000):
        accel[first : first + 8, 0] = np.clip(ring, -78.5, 78.5)
    found, counts = marks(ImuBatch(swing.times, swing.gyro, accel))
    assert set(np.flatnonzero(found.any(axis=0))) == {3}
    assert counts["preprocess.gyro_at_limit"] == 0
    assert counts["preprocess.accel_at_limit"] == 12


@pytest.mark.parametrize("resolution", [0.002, 0.01, 0.1])
def test_a_steady_turn_in_coarse_steps_is_no_limit(swing, rng, resolution):
    gyro = swing.gyro.copy()
    gyro[:, 1] = rng.normal(0.0, 0.003, len(gyro)) + np.minimum(swing.times, 3.0) * 0.15
    found, counts = marks(
        ImuBatch(swing.times, np.round(gyro / resolution) * resolution, swing.accel)
    )
    assert not found.any(), counts


def test_a_unit_that_repeats_itself_is_at_no_limit(swing):
    batch = swing.where(np.minimum(np.arange(len(swing.times)), 52))
    assert batch.gyro[52, 1] > 0.5
    found, _ = marks(ImuBatch(swing.times, batch.gyro, batch.accel))
    assert not found.any()


def test_what_lasts_longer_than_can_be_bridged_is_left_as_it_is(swing):
    # At 0.35 rad/s a swing is cut off for 0.3 s.
    found, _ = marks(clipped(swing, 0.35))
    assert not found[swing.times > 2.0].any()


def test_a_greater_value_shows_that_it_was_no_limit(swing):
    batch = clipped(swing)
    gyro = np.where((batch.times > 10.0)[:, None], swing.gyro, batch.gyro)
    found, _ = marks(ImuBatch(batch.times, gyro, batch.accel))
    assert found[batch.times < 10.0].any()
    assert not found[batch.times > 10.5].any()
