# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
import pytest

from bentwing import _core
from bentwing.base import geometry

LIMIT = 0.5  # rad/s


def swing():
    """Stamps and rates (M, 3) of a swing about z of one second and up to 0.6 rad/s."""
    times = np.arange(-0.2, 1.5, 0.005)
    rates = np.zeros((len(times), 3))
    rates[:, 2] = 0.6 * np.sin(2 * np.pi * times)
    return times, rates


def turned(states, imu) -> float:
    """How far half a swing has turned, rad."""
    quats = np.tile([0.0, 0.0, 0.0, 1.0], (3, 1))
    samples = _core.Samples(-0.02, 0.01, np.zeros((3, 3)), quats)
    extended, n_blind = samples.extended(imu, states(), 0.5)
    assert n_blind == 0
    return float(geometry.log(extended.quats_xyzw[-1:])[0, 2])


def test_a_swing_beyond_the_limit_of_a_gyro_is_bridged(states):
    times, rates = swing()
    force = np.tile([0.0, 0.0, 9.80665], (len(times), 1))
    cut = np.clip(rates, -LIMIT, LIMIT)
    at_limit = np.zeros((len(times), 6), np.bool_)
    at_limit[:, :3] = np.abs(cut) == LIMIT
    exact = turned(states, _core.Imu(times, rates, force))
    lost = exact - turned(states, _core.Imu(times, cut, force))
    left = exact - turned(states, _core.Imu(times, cut, force, at_limit))
    # The analytic loss: of the part of the sine above 5/6 of its height.
    above = np.arccos(LIMIT / 0.6) / (2 * np.pi)
    assert lost == pytest.approx(
        2 * (0.6 * np.sin(2 * np.pi * above) / (2 * np.pi) - LIMIT * above), rel=0.05
    )
    assert abs(left) < 0.2 * lost


@pytest.mark.parametrize("shape", [(340, 3), (339, 6), (340,)])
def test_limits_of_another_shape_are_refused(shape):
    times, rates = swing()
    assert len(times) == 340
    with pytest.raises((ValueError, TypeError), match="at_limit"):
        _core.Imu(times, rates, rates, np.zeros(shape, np.bool_))
