# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scales of gyro and ranges, by trials that answer as the estimator does."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.calibrate.set_up.errors import DefectError
from bentwing.calibrate.set_up.scales import require_scale_of_gyro, require_scale_of_ranges


def trial(off, *, promising=0.1):
    """What a trial says whose scale is wrong by a factor, the logarithm of which is `off`."""
    window = SimpleNamespace(residual_rms=0.3 + abs(off), accel_rms=0.5 + 20 * abs(off))
    return SimpleNamespace(is_promising=abs(off) < promising, last=window)


def refusal(call):
    """What is refused, None if nothing is."""
    try:
        call()
    except DefectError as error:
        return str(error)
    return None


def of_scale(truth, **values):
    return lambda scale: trial(np.log(scale / truth), **values)


@pytest.mark.parametrize("truth", [0.6, 0.85, 1.2, 2.0])
def test_a_gyro_with_a_wrong_scale_is_refused_with_the_scale(truth):
    tried = of_scale(truth)
    with pytest.raises(DefectError, match="times the turn") as refused:
        require_scale_of_gyro(tried, tried)
    said = float(str(refused.value).split("about ")[1].split()[0])
    assert said == pytest.approx(truth, rel=0.03)


def test_a_gyro_with_which_nothing_fits_at_any_scale_is_not_blamed():
    tried = of_scale(40.0)
    assert refusal(lambda: require_scale_of_gyro(tried, tried)) is None


@pytest.mark.parametrize("truth", [0.8, 1.3])
def test_ranges_with_a_wrong_scale_are_refused_with_what_corrects_them(truth):
    with pytest.raises(DefectError, match="range_scale") as refused:
        require_scale_of_ranges(of_scale(truth, promising=9.0))
    said = float(str(refused.value).split("range_scale: ")[1].rstrip("}"))
    assert said == pytest.approx(1 / truth, rel=0.03)


def test_ranges_are_not_blamed_for_forces_that_no_scale_explains():
    def tried(scale):
        window = SimpleNamespace(residual_rms=0.3, accel_rms=6.0 + abs(np.log(scale)))
        return SimpleNamespace(is_promising=True, last=window)

    assert refusal(lambda: require_scale_of_ranges(tried)) is None


def test_ranges_that_are_right_are_not_blamed():
    for scale in (1.0, 1.02):
        tried = of_scale(scale, promising=9.0)
        assert refusal(lambda tried=tried: require_scale_of_ranges(tried)) is None
