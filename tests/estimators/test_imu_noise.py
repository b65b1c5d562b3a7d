# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the windows of the continuous estimator say of the IMU's noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bentwing.recording import ImuBatch

from .conftest import CASES

NAMES = ("gyro_rms", "accel_rms", "gyro_correlation", "accel_correlation")


def said(estimate):
    """Columns of `NAMES` of the windows that say all of them."""
    rows = [[getattr(w, name) for name in NAMES] for w in estimate.windows]
    return np.array([row for row in rows if None not in row])


def weighted_with(estimate):
    """Noise of gyro and accelerometer in most windows."""
    return np.median([w.imu_noise for w in estimate.windows if w.imu_noise], axis=0)


@pytest.fixture
def flown_with(heads, run):
    def fly(change, **settings):
        batches = [change(b) if isinstance(b, ImuBatch) else b for b in heads("continuous").batches]
        chosen = CASES["continuous"].settings.model_copy(update=settings)
        return run("continuous", batches=batches, settings=chosen)

    return fly


def test_the_noise_of_a_good_flight_is_as_stated_and_white(plain_run):
    found = said(plain_run("continuous"))
    assert len(found) >= 3
    # Five means in three axes each; a payload may state up to twice the noise it has.
    assert np.all(np.median(found[:, :2], axis=0) > 0.4)
    assert np.all(np.median(found[:, :2], axis=0) < 1.5)
    assert np.all(np.abs(np.median(found[:, 2:], axis=0)) < 0.4)


def test_a_gyro_of_the_wrong_scale_shows_in_its_residuals_where_its_scale_is_frozen(flown_with):
    found = flown_with(
        lambda batch: replace(batch, gyro=1.1 * batch.gyro),
        frozen=("gyro_scale", "gyro_misalignment"),
    )
    assert np.max(said(found)[:, 0]) > 3.0


def test_windows_are_weighted_with_the_noise_of_a_noisier_gyro_alone(plain_run, flown_with):
    rng = np.random.default_rng(4)

    def noisier(batch):
        return replace(batch, gyro=batch.gyro + rng.normal(0.0, 0.03, batch.gyro.shape))

    bad = flown_with(noisier)
    (gyro, accel), (noisy, same) = weighted_with(plain_run("continuous")), weighted_with(bad)
    assert noisy > 3.0 * gyro
    assert same == accel
    # So its residuals are what is expected of it.
    assert np.median(said(bad)[:, 0]) < 1.5
