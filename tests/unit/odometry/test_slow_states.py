# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is known of the slow states, against problems whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.odometry.continuous.slow_states import INITIAL_STD, SLICES, SlowStatePrior
from bentwing.odometry.start import attitude_of
from bentwing.recording.sections.imu import Imu

BIAS, GRAVITY = SLICES["accel_bias"], SLICES["gravity"]


@pytest.fixture
def prior():
    return SlowStatePrior(Imu(), has_motor=True, moving=False, frozen=())


def covariance(prior):
    return np.linalg.inv(prior.information)


def test_a_rest_tells_the_horizontal_sum_of_gravity_and_accelerometer_bias(prior):
    """A force at rest is explained by any bias, if gravity is turned by what it leaves."""
    force = np.array([0.6, -0.4, 9.78])
    quat = attitude_of(force)
    before = prior.information.copy()
    prior.observe_rest(quat, np.zeros(3))
    gained = prior.information - before
    # Only bias and gravity are concerned, and both together are as unknown as they were.
    state = np.zeros(20)
    state[BIAS] = [1e-4, -2e-4, 1e-4]
    left = geometry.rotate(quat[None], (force - state[BIAS])[None])[0]
    turn = np.cross([0.0, 0.0, 1.0], left / np.linalg.norm(left))
    state[GRAVITY] = turn[:2]
    assert state @ gained @ state < 1e-6
    assert np.sqrt(np.diag(covariance(prior)))[BIAS] == pytest.approx(
        INITIAL_STD["accel_bias"], rel=0.05
    )
    # A tilt without the bias that explains it is not.
    tilt = np.zeros(20)
    tilt[GRAVITY] = [1e-3, 0.0]
    assert tilt @ gained @ tilt == pytest.approx((1e-3 * STANDARD_GRAVITY / 2e-3) ** 2)


def test_the_mean_stays_where_it_was_until_the_rest_says_otherwise(prior):
    """With the bias already corrected by 0.02 m/s², gravity is believed to have turned with it."""
    prior._offset[BIAS] = [0.02, 0.0, 0.0]
    prior.observe_rest(np.array([0.0, 0.0, 0.0, 1.0]), np.zeros(3))
    # The current values fit the rest; between them and the mean lies what the prior has believed.
    offset = np.array(prior.offset)
    assert 0.0 < offset[BIAS][0] < 0.02
    assert offset[BIAS][0] + STANDARD_GRAVITY * offset[GRAVITY][1] == pytest.approx(0.0, abs=1e-4)


def test_a_reset_state_leaves_what_is_known_of_the_others(prior):
    prior.observe_rest(attitude_of(np.array([0.6, -0.4, 9.78])), np.zeros(3))
    before = covariance(prior)
    prior.reset("gravity", 0.1)
    after = covariance(prior)
    others = np.setdiff1d(np.arange(20), np.arange(20)[GRAVITY])
    assert after[np.ix_(others, others)] == pytest.approx(before[np.ix_(others, others)])
    assert np.sqrt(np.diag(after))[GRAVITY] == pytest.approx([0.1, 0.1])
    assert after[GRAVITY, others].max() == pytest.approx(0.0, abs=1e-15)
