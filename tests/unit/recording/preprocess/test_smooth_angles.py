# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing.recording import EncoderBatch
from bentwing.recording.preprocess.smooth_angles import SmoothAngles

RATE_HZ = 200.0
STEP = 2 * np.pi / 4096


def motion(times):
    """A motor that turns, with a ripple of 2 Hz."""
    return 6.0 * times + 0.05 * np.sin(2 * np.pi * 2.0 * times)


def smoothed(times, angles, size=20):
    """Return what becomes of angles that come `size` at a time."""
    smooth = SmoothAngles()
    parts = [
        smooth.add(EncoderBatch(times[i : i + size], angles[i : i + size]))
        for i in range(0, len(times), size)
    ]
    given = [part for part in [*parts, smooth.finish()] if part is not None]
    return (np.concatenate([getattr(part, name) for part in given]) for name in ("times", "angles"))


def test_coarse_steps_of_a_smooth_motion_leave_less_than_half():
    times = np.arange(0.0, 5.0, 1 / RATE_HZ)
    read = np.round(motion(times) / STEP) * STEP
    at, found = smoothed(times, read)
    assert np.array_equal(at, times)
    later = times > 1.0
    # A parabola through nine independent errors knows its middle to half of one of them.
    assert np.std((found - motion(times))[later]) < 0.55 * np.std((read - motion(times))[later])


def test_stamps_that_jitter_are_noise_of_the_angles():
    times = np.arange(0.0, 5.0, 1 / RATE_HZ)
    read = motion(times + np.random.default_rng(1).normal(0.0, 1e-4, len(times)))
    _, found = smoothed(times, read)
    later = times > 1.0
    assert np.std((found - motion(times))[later]) < 0.6 * np.std((read - motion(times))[later])


@pytest.mark.parametrize("size", [1, 7, 64, 333])
def test_pieces_of_any_size_become_the_same_to_the_bit(size):
    times = np.arange(0.0, 3.0, 1 / RATE_HZ)
    read = np.round(motion(times) / STEP) * STEP
    at, found = smoothed(times, read, size)
    known_at, known = smoothed(times, read)
    assert np.array_equal(at, known_at)
    assert np.array_equal(found, known)


@pytest.mark.parametrize("sigma", [0.0, 2e-4])
def test_fine_angles_stay_as_they_are_to_the_bit(sigma):
    times = np.arange(0.0, 5.0, 1 / RATE_HZ)
    read = motion(times) + np.random.default_rng(2).normal(0.0, sigma, len(times))
    at, found = smoothed(times, read)
    assert np.array_equal(found, read)
    assert np.array_equal(at, times)


def test_a_reversal_is_not_rounded_off():
    times = np.arange(0.0, 5.0, 1 / RATE_HZ)
    true = 3.0 * np.abs(times - 2.5)
    read = np.round(true / STEP) * STEP
    _, found = smoothed(times, read)
    assert np.abs(found - true).max() < 3 * STEP


def test_a_slow_encoder_is_left_alone():
    times = np.arange(0.0, 20.0, 0.05)
    read = np.round(motion(times) / STEP) * STEP
    assert np.array_equal(list(smoothed(times, read))[1], read)


def test_batches_of_any_size_give_all_angles_in_order():
    times = np.arange(0.0, 3.0, 1 / RATE_HZ)
    read = np.round(motion(times) / STEP) * STEP
    for size in (1, 7, 600):
        assert np.array_equal(next(smoothed(times, read, size)), times)
