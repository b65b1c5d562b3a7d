# SPDX-License-Identifier: MIT OR Apache-2.0
"""The lidar on its motor, from revolutions whose truth is exact."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bentwing.base import geometry
from bentwing.base.errors import DivergedError, RecordingError
from bentwing.calibrate.motor_mount import calibrate_motor

ANGLE = st.floats(-0.02, 0.02)
SHIFT = st.floats(-0.005, 0.005)


def errors(found, true, axis):
    """Angles (rad) and shifts (m) across the axis by which a calibration is wrong (4,)."""
    apart = geometry.multiply(found.T_motor_lidar.quaternion, geometry.inverse(true.quaternion))
    about = np.append(axis * (apart[:3] @ axis), apart[3])
    about /= np.linalg.norm(about)
    quat, t = geometry.multiply(about, true.quaternion), geometry.rotate(about, true.translation)
    left = geometry.multiply(found.T_motor_lidar.quaternion, geometry.inverse(quat))
    return np.concatenate(
        [found.across @ geometry.log(left), found.across @ (found.T_motor_lidar.translation - t)]
    )


@given(angles=st.tuples(ANGLE, ANGLE, ANGLE), shift=st.tuples(SHIFT, SHIFT, SHIFT))
@settings(max_examples=4, deadline=None)
def test_without_noise_angles_are_recovered_to_microradians(room, angles, shift):
    true = room.perturbed(angles, shift)
    seen = room.revolution(true)
    found = calibrate_motor(seen, room.axis, room.nominal, sigma=0.002)
    # The standard deviations that it states are a little below one.
    assert np.abs(errors(found, true, room.axis)[:2]).max() < 5e-6
    assert np.abs(errors(found, true, room.axis)[2:]).max() < 1e-5


def test_what_is_along_the_axis_stays_as_it_was(room):
    true = room.perturbed([0.004, -0.003, 0.01], [0.002, 0.001, 0.02])
    found = calibrate_motor(room.revolution(true), room.axis, room.nominal, sigma=0.01)
    turn = geometry.multiply(
        found.T_motor_lidar.quaternion, geometry.inverse(room.nominal.quaternion)
    )
    assert abs(geometry.log(turn) @ room.axis) < 1e-4  # of second order
    shift = found.T_motor_lidar.translation - room.nominal.translation
    assert abs(shift @ room.axis) < 1e-12


def test_errors_are_as_large_as_stated(room):
    squares = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        true = room.perturbed(rng.normal(0.0, 0.004, 3), rng.normal(0.0, 0.002, 3))
        seen = room.revolution(true, sigma=0.02, n=40_000, seed=seed)
        found = calibrate_motor(seen, room.axis, room.nominal, sigma=0.02)
        error, covariance = errors(found, true, room.axis), found.covariance[:4, :4]
        assert np.degrees(np.abs(error[:2])).max() < 0.02
        squares.append(error @ np.linalg.solve(covariance, error))
    # 99.9 % of the means of eight χ² with four degrees of freedom
    assert 1.5 < np.mean(squares) < 7.9


def test_the_delay_is_seen_when_the_motor_turns_back(room):
    true = room.perturbed([0.003, 0.002, 0.0], [0.0, 0.0, 0.0])
    both = room.revolution(true, rate=[3.0, -3.0], sigma=0.01, delay=2e-3)
    found = calibrate_motor(both, room.axis, room.nominal, sigma=0.01)
    assert abs(found.delay - 2e-3) < 4 * found.std[4]
    assert found.std[4] < 1e-4
    one = room.revolution(true, rate=3.0, sigma=0.01, delay=2e-3)
    assert calibrate_motor(one, room.axis, room.nominal, sigma=0.01).std[4] > 2e-3


def test_a_room_without_planes_is_refused(room):
    seen = room.revolution(room.nominal, n=20_000)
    rng = np.random.default_rng(1)
    seen.points[:] = rng.normal(size=seen.points.shape) * [8.0, 8.0, 4.0]
    with pytest.raises(RecordingError, match="walls, floor and ceiling"):
        calibrate_motor(seen, room.axis, room.nominal, sigma=0.02)


def test_a_mount_that_is_described_wrongly_is_not_corrected_in_silence(room):
    true = room.perturbed([0.0, 0.35, 0.0], [0.0, 0.0, 0.0])
    with pytest.raises((DivergedError, RecordingError), match=r"T_motor_lidar|plane"):
        calibrate_motor(room.revolution(true, sigma=0.01), room.axis, room.nominal, sigma=0.01)
