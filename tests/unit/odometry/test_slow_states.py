# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is known of the slow states, against problems whose answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.odometry.continuous.slow_states import (
    INITIAL_STD,
    N_STATES,
    SLICES,
    UNIT_STATES,
    SlowStatePrior,
    at_epoch,
    initial_std,
    places_of,
)
from bentwing.odometry.start import attitude_of
from bentwing.recording.sections.imu import Imu
from bentwing.recording.sections.imu_errors import USUAL, ImuErrors

BIAS, GRAVITY = SLICES["accel_bias"], SLICES["gravity"]


@pytest.fixture
def prior():
    return SlowStatePrior(Imu(kind="tactical"), has_motor=True, moving=False, frozen=())


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
    state = np.zeros(N_STATES)
    state[BIAS] = [1e-4, -2e-4, 1e-4]
    left = geometry.rotate(quat[None], (force - state[BIAS])[None])[0]
    turn = np.cross([0.0, 0.0, 1.0], left / np.linalg.norm(left))
    state[GRAVITY] = turn[:2]
    assert state @ gained @ state < 1e-6
    assert np.sqrt(np.diag(covariance(prior)))[BIAS] == pytest.approx(
        INITIAL_STD["accel_bias"], rel=0.05
    )
    # A tilt without the bias that explains it is not.
    tilt = np.zeros(N_STATES)
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
    others = np.setdiff1d(np.arange(N_STATES), np.arange(N_STATES)[GRAVITY])
    assert after[np.ix_(others, others)] == pytest.approx(before[np.ix_(others, others)])
    assert np.sqrt(np.diag(after))[GRAVITY] == pytest.approx([0.1, 0.1])
    assert after[GRAVITY, others].max() == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("kind", list(USUAL))
def test_a_unit_may_be_as_wrong_as_its_kind(kind):
    prior = SlowStatePrior(Imu(kind=kind), has_motor=False, moving=False, frozen=())
    std = np.sqrt(np.diag(covariance(prior)))
    for name in UNIT_STATES:
        assert std[SLICES[name]] == pytest.approx(USUAL[kind][name])
        assert not prior.frozen[SLICES[name]].any()


def test_own_figures_count_before_those_of_the_kind_and_what_is_exact_is_frozen():
    imu = Imu(kind="industrial", errors=ImuErrors(gyro_scale=0.02, g_sensitivity=0.0))
    prior = SlowStatePrior(imu, has_motor=False, moving=False, frozen=["accel_scale"])
    std = np.sqrt(np.diag(covariance(prior)))
    assert std[SLICES["gyro_scale"]] == pytest.approx(0.02)
    assert std[SLICES["accel_misalignment"]] == pytest.approx(3e-3)
    frozen = {name for name in UNIT_STATES if prior.frozen[SLICES[name]].all()}
    assert frozen == {"g_sensitivity", "accel_scale"}


def test_the_bias_and_the_mount_are_less_certain_by_what_the_unit_adds_to_them():
    """The bias is that under gravity, and the frame of the unit is that of its gyro."""
    prior = SlowStatePrior(Imu(), has_motor=False, moving=False, frozen=())
    std = np.sqrt(np.diag(covariance(prior)))
    usual = USUAL["consumer"]
    force = STANDARD_GRAVITY * np.hypot(usual["accel_scale"], usual["accel_misalignment"])
    assert std[BIAS] == pytest.approx(np.hypot(INITIAL_STD["accel_bias"], force))
    assert std[SLICES["extrinsic_rotation"]] == pytest.approx(
        np.hypot(INITIAL_STD["extrinsic_rotation"], usual["gyro_misalignment"])
    )


def test_a_unit_is_taken_as_ideal_where_the_start_is_in_motion():
    imu = Imu(kind="consumer")
    moving, resting = (
        SlowStatePrior(imu, has_motor=False, moving=moving, frozen=()) for moving in (True, False)
    )
    for name in UNIT_STATES:
        assert moving.frozen[SLICES[name]].all()
        assert not resting.frozen[SLICES[name]].any()
    # Nor are the others less certain for it.
    known = np.sqrt(1.0 / np.diag(moving.information))
    assert known[SLICES["accel_bias"]] == pytest.approx(initial_std(moving=True)["accel_bias"])


def test_places_are_those_of_the_named_states_alone():
    chosen = places_of(["latency", "accel_misalignment"])
    latency = SLICES["latency"].start
    assert np.flatnonzero(chosen).tolist() == [latency, *range(N_STATES - 6, N_STATES)]


def test_without_an_imu_its_states_are_frozen():
    prior = SlowStatePrior(None, has_motor=True, moving=True, frozen=())
    assert all(prior.frozen[SLICES[name]].all() for name in UNIT_STATES)


def test_a_latency_is_less_certain_away_from_where_it_was_seen():
    covariance = np.zeros((N_STATES, N_STATES))
    latency, rate = SLICES["latency"].start, SLICES["latency_rate"].start
    covariance[latency, latency] = 1e-8
    covariance[rate, rate] = 1e-12
    moved = at_epoch(covariance, 100.0)
    assert moved[latency, latency] == pytest.approx(1e-8 + 100.0**2 * 1e-12)
    np.testing.assert_allclose(at_epoch(moved, -100.0), covariance, atol=1e-20)
