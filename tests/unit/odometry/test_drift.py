# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the windows' covariances add up."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.odometry.continuous import drift as module
from bentwing.odometry.continuous.drift import Drift, inflation_of
from bentwing.odometry.continuous.slow_states import N_STATES, SLICES

SPEED = 2.0  # m/s, along x
N_VIEWS = 5
SIGMAS = np.array([1e-3, 1e-3, 2e-3, 0.01, 0.01, 0.02])  # rad and m, of every window


def window(**changed):
    values = {
        "gyro_rms": 0.9, "accel_rms": 1.0, "residual_rms": 0.3, "covariance": np.zeros((N_STATES, N_STATES)),
        "covariance_at": lambda _: np.diag(SIGMAS**2),
        "samples": SimpleNamespace(position_at=lambda t: np.array([SPEED * t, 0.0, 0.0]), start=0.0),
    }  # fmt: skip
    return SimpleNamespace(**(values | changed))


def flown(n, result):
    """Covariances after n windows of a second."""
    drift, times = Drift(N_VIEWS), np.arange(0.0, n + 0.5, 0.5)
    for k in range(n):
        drift.add(result, float(k), k + 1.0, k + 1.0)
    positions = np.outer(times, [SPEED, 0.0, 0.0])
    trajectory = Trajectory(times, positions, np.tile([0.0, 0.0, 0.0, 1.0], (len(times), 1)))
    return drift.covariances(trajectory, np.zeros(3)), drift.short_covariances(trajectory)


def test_a_pass_is_certain_where_it_begins():
    found, _ = flown(3, window())
    assert found.times.tolist() == [0.0, 1.0, 2.0, 3.0]
    assert np.all(found.matrices[0] == 0.0)


def test_heading_and_position_drift_as_a_random_walk_and_tilt_does_not():
    variances = np.einsum("kii->ki", flown(9, window())[0].matrices)
    one, nine = variances[1], variances[9]
    assert nine[2] == pytest.approx(9 * one[2])
    assert nine[3] == pytest.approx(9 * one[3])
    np.testing.assert_allclose(nine[:2], one[:2])


def test_an_error_of_heading_moves_what_comes_later_sideways():
    variances = np.einsum("kii->ki", flown(9, window())[0].matrices)
    # The k-th error of heading has 9 - k more seconds to go.
    sideways = variances[1, 2] * sum((SPEED * (9 - k)) ** 2 for k in range(1, 10))
    assert variances[9, 4] == pytest.approx(variances[9, 3] + sideways)


def test_a_share_of_what_a_window_errs_by_adds_up():
    variances = np.einsum("kii->ki", flown(1, window())[0].matrices)[1]
    assert variances[3] == pytest.approx(SIGMAS[3] ** 2 / N_VIEWS)
    assert variances[2] == pytest.approx(module.HEADING * SIGMAS[2] ** 2 / N_VIEWS)


def test_windows_that_grow_from_one_start_do_not_add_up():
    drift, result = Drift(N_VIEWS), window()
    for leaving in (0.5, 1.0, 1.5):
        drift.add(result, 0.0, leaving, leaving + 1.0)
    times = np.arange(0.0, 3.0, 0.5)
    still = Trajectory(times, np.zeros((6, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (6, 1)))
    variances = np.einsum("kii->ki", drift.covariances(still, np.zeros(3)).matrices)
    np.testing.assert_allclose(variances[1:, 3], SIGMAS[3] ** 2 / N_VIEWS)


def test_over_ten_metres_what_came_before_does_not_count():
    found, short = flown(9, window())
    five = np.einsum("kii->ki", found.matrices)[5]  # ten metres behind the start
    assert len(short) == 5
    np.testing.assert_allclose(np.einsum("kii->ki", short), np.tile(five, (5, 1)))


def test_doubt_about_gravity_lifts_the_far_end():
    known = np.zeros((N_STATES, N_STATES))
    known[SLICES["gravity"].start + 1, SLICES["gravity"].start + 1] = 1e-6  # rad², about y
    (plain, _), (doubted, _) = flown(4, window()), flown(4, window(covariance=known))
    added = np.diag(doubted.matrices[-1] - plain.matrices[-1])
    tilt = module.GRAVITY * 1e-6
    np.testing.assert_allclose(added, [0, tilt, 0, 0, 0, tilt * (4 * SPEED) ** 2], atol=1e-15)


@pytest.mark.parametrize(
    ("changed", "expected"),
    [
        ({}, 1.0),
        ({"residual_rms": 3.0}, 9.0),
        ({"gyro_rms": 5.0}, 25.0),
        ({"gyro_rms": None, "accel_rms": None}, 1.0),
    ],
)
def test_larger_residuals_than_stated_inflate_and_smaller_ones_do_not_deflate(changed, expected):
    assert inflation_of(window(**changed)) == pytest.approx(expected)
