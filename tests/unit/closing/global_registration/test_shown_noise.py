# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the windows' residuals say of the noise of an IMU."""

from types import SimpleNamespace

from bentwing.closing.global_registration.shown_noise import shown_noise


def shown(*windows):
    names = ("time", "gyro_rms", "accel_rms")
    records = [SimpleNamespace(**dict(zip(names, w, strict=True))) for w in windows]
    return shown_noise(SimpleNamespace(windows=records))


def test_an_accelerometer_may_be_better_than_stated_and_a_gyro_not():
    times, ratios = shown((1.0, 0.5, 0.4), (2.0, 3.0, 2.0))
    assert times == [1.0, 2.0]
    assert ratios == [(1.0, 0.4), (3.0, 2.0)]


def test_windows_that_cannot_tell_take_the_nearest_that_can():
    _, ratios = shown((1.0, None, None), (2.0, 2.0, 0.5), (3.0, None, 0.7), (4.0, 4.0, None))
    assert ratios == [(2.0, 0.5), (2.0, 0.5), (3.0, 0.7), (4.0, 0.7)]


def test_where_none_can_tell_the_noise_is_as_stated():
    assert shown((1.0, None, None)) == ([1.0], [(1.0, 1.0)])
    assert shown() == ([], [])
