# SPDX-License-Identifier: MIT OR Apache-2.0
"""The noise that a window is weighted with: as stated, unless the samples contradict it."""

import numpy as np
import pytest

from bentwing.odometry.imu_noise import BelievedNoise, ImuNoise
from bentwing.recording import ImuBatch

TRUE = ImuNoise(5e-4, 0.012)


def samples(noise: ImuNoise, seconds: float = 5.0, rate: float = 200.0) -> ImuBatch:
    """White noise upon the motion of a head that turns and sways."""
    rng = np.random.default_rng(1)
    times = np.arange(0.0, seconds, 1.0 / rate)
    sway = np.stack([np.sin(6.0 * times), np.cos(6.0 * times), 0.3 * np.sin(9.0 * times)], axis=1)
    gyro, accel = (
        size * np.sqrt(rate) * rng.normal(size=(len(times), 3))
        for size in (noise.gyro, noise.accel)
    )
    return ImuBatch(times, 0.5 * sway + gyro, 2.0 * sway + accel)


@pytest.mark.parametrize("rate", [100.0, 200.0, 400.0])
def test_the_noise_of_samples_is_measured_whatever_the_motion(rate):
    found = ImuNoise.of(samples(TRUE, rate=rate))
    assert found.gyro == pytest.approx(TRUE.gyro, rel=0.2)
    assert found.accel == pytest.approx(TRUE.accel, rel=0.2)


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.25])
def test_a_stated_noise_that_is_about_right_stays_exactly_what_it_is(factor):
    stated = ImuNoise(factor * TRUE.gyro, factor * TRUE.accel)
    assert BelievedNoise.as_stated(stated).after(samples(TRUE), settled=True).now == stated


@pytest.mark.parametrize("factor", [0.2, 1 / 3, 3.0, 5.0])
def test_samples_replace_a_noise_that_they_contradict(factor):
    stated = ImuNoise(factor * TRUE.gyro, factor * TRUE.accel)
    found = BelievedNoise.as_stated(stated).after(samples(TRUE), settled=True).now
    assert found.gyro == pytest.approx(TRUE.gyro, rel=0.2)
    assert found.accel == pytest.approx(TRUE.accel, rel=0.2)


def test_a_carrier_that_is_still_calm_does_not_contradict_a_large_noise():
    calm = samples(ImuNoise(TRUE.gyro, 0.1 * TRUE.accel))
    beginning = BelievedNoise.as_stated(TRUE).after(calm, settled=False)
    assert beginning.now == TRUE
    landed = beginning.after(samples(TRUE), settled=True).after(calm, settled=True)
    assert landed.now == TRUE


def test_less_than_a_second_says_nothing():
    stated = ImuNoise(0.1 * TRUE.gyro, 0.1 * TRUE.accel)
    found = BelievedNoise.as_stated(stated).after(samples(TRUE, seconds=0.5), settled=True)
    assert found.now == stated


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kept", [slice(0, 3), np.r_[0:8, 300:308], slice(None, None, 100)])
def test_few_samples_say_nothing_however_far_they_reach(kept):
    all_of_them = samples(ImuNoise(5.0 * TRUE.gyro, TRUE.accel))
    few = ImuBatch(*(getattr(all_of_them, name)[kept] for name in ("times", "gyro", "accel")))
    assert BelievedNoise.as_stated(TRUE).after(few, settled=True).now == TRUE
