# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.calibrate.inspection.spin import spin_from_gyro
from bentwing.flight.control import StallWatch

USUAL = 5.0


def rates(*stretches, step=0.01):
    """Rates (K,) and times (K,) of stretches of (length in s, rate)."""
    values = np.concatenate([np.full(round(length / step), rate) for length, rate in stretches])
    return step * np.arange(len(values)), values


def gyro(values):
    return np.column_stack([np.zeros((len(values), 2)), values])


def test_a_head_that_stands_before_the_first_turn_is_not_stalled():
    times, values = rates((5.0, 0.0))
    assert StallWatch(USUAL).add_gyro(times, gyro(values)) is None


def test_a_stall_is_found_while_it_lasts_and_forgotten_afterwards():
    watch = StallWatch(USUAL)
    times, values = rates((3.0, USUAL), (1.5, 0.2), (2.0, USUAL))
    assert watch.add_gyro(times[:300], gyro(values[:300])) is None
    stall = watch.add_gyro(times[300:450], gyro(values[300:450]))
    assert stall is not None
    assert stall.start == pytest.approx(3.0, abs=0.2)
    assert stall.length == pytest.approx(1.5, abs=0.2)
    assert "add thrust" in stall.warning
    assert watch.add_gyro(times[450:], gyro(values[450:])) is None


def test_the_watch_and_the_inspection_find_the_same_stall():
    times, values = rates((4.0, USUAL), (1.6, 0.3), (4.0, USUAL))
    watch, longest = StallWatch(USUAL), 0.0
    for k in range(len(times)):
        stall = watch.add_gyro(times[k : k + 1], gyro(values[k : k + 1]))
        longest = max(longest, stall.length if stall else 0.0)
    ((_, length),) = spin_from_gyro(times, gyro(values)).stalls
    assert longest == pytest.approx(length, abs=0.3)


def test_an_encoder_tells_it_too_and_warnings_fit_a_mavlink_text():
    watch = StallWatch(USUAL)
    times, values = rates((3.0, USUAL), (3.0, 0.0))
    angles = np.cumsum(values) * 0.01
    for part in np.array_split(np.arange(len(times)), 50):
        stall = watch.add_encoder(times[part], angles[part])
    assert stall is not None
    assert stall.length > 2.0
    assert "map is cut" in stall.warning
    assert len(stall.warning) <= 50


def test_samples_that_cannot_be_used_are_counted():
    watch = StallWatch(USUAL)
    watch.add_gyro([0.0, 0.1, np.nan, 0.05], gyro(np.array([5.0, np.nan, 5.0, 5.0])))
    assert watch.n_refused == 2
    watch.add_gyro([-1.0], gyro(np.array([5.0])))
    assert watch.n_refused == 3
    watch.add_encoder([0.2, np.nan], [0.0, 1.0])
    assert watch.n_refused == 4


def test_a_rate_of_zero_is_refused():
    with pytest.raises(UsageError, match="usual_rate"):
        StallWatch(0.0)
