# SPDX-License-Identifier: MIT OR Apache-2.0
"""Numbers and values of the core that are no arrays."""

import numpy as np
import pytest

from bentwing import _core
from bentwing.odometry.continuous.settings import RegistrationSettings
from bentwing.odometry.continuous.slow_states import N_STATES

UNIT = (0.0, 0.0, 0.0, 1.0)
HERE = ((0.0, 0.0, 0.0), UNIT)
MOTOR = {"motor_axis": (0.0, 0.0, 2.0), "T_motor_lidar": HERE}
NAN = float("nan")


@pytest.mark.parametrize("name", ["gyro_bias", "accel_bias", "gravity"])
@pytest.mark.parametrize("value", [NAN, float("inf")])
def test_vectors_of_the_slow_states_must_be_finite(states, name, value):
    with pytest.raises(ValueError, match=f"^{name}: expected finite numbers"):
        states(**{name: (0.0, value, 0.0)})


def test_the_latency_must_be_finite(states):
    with pytest.raises(ValueError, match=r"^latency: expected a finite number, got NaN"):
        states(latency=NAN)


@pytest.mark.parametrize("q", [(0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.1), (NAN, 0.0, 0.0, 1.0)])
def test_transforms_need_a_unit_quaternion(states, q):
    with pytest.raises(ValueError, match=r"^T_imu_base: expected a unit quaternion, got norm"):
        states(((0.0, 0.0, 0.0), q))
    with pytest.raises(ValueError, match=r"^T_motor_lidar: expected a unit quaternion, got norm"):
        states(motor_axis=(0.0, 0.0, 1.0), T_motor_lidar=((0.0, 0.0, 0.0), q))


def test_translations_must_be_finite(states):
    with pytest.raises(ValueError, match=r"^T_imu_base: expected finite numbers"):
        states(((0.0, NAN, 0.0), UNIT))


@pytest.mark.parametrize("axis", [(0.0, 0.0, 0.0), (NAN, 0.0, 1.0)])
def test_the_axis_of_a_motor_must_have_a_direction(states, axis):
    with pytest.raises(ValueError, match=r"^motor_axis: expected"):
        states(**{**MOTOR, "motor_axis": axis})


@pytest.mark.parametrize("name", list(MOTOR))
def test_a_motor_is_described_wholly_or_not_at_all(states, name):
    with pytest.raises(ValueError, match="motor_axis and T_motor_lidar go together"):
        states(**{name: MOTOR[name]})


def test_slow_states_come_back_as_they_were_given(states):
    rows = [[1e-3 * (3 * r + c) for c in range(3)] for r in range(3)]
    unit = (rows, [[2.0 * v for v in row] for row in rows], rows[::-1], [0.1, 0.2, 9.8], 1)
    given = states(
        ((0.1, 0.2, 0.3), UNIT),
        latency=0.002,
        gyro_bias=(1e-3, 2e-3, 3e-3),
        unit=unit,
        encoder_zero=0.01,
        **MOTOR,
    )
    assert given.latency == 0.002
    assert given.base_translation.tolist() == [0.1, 0.2, 0.3]
    assert given.gyro_bias.tolist() == [1e-3, 2e-3, 3e-3]
    assert given.encoder_zero == 0.01
    assert given.unit == unit
    assert states().encoder_zero == 0.0
    assert states().motor_lidar_translation is None


def test_an_inertial_unit_must_be_finite_and_have_a_main_axis(states):
    none = np.zeros((3, 3))
    with pytest.raises(ValueError, match=r"^unit: expected finite numbers"):
        states(unit=(none, none + NAN, none, np.zeros(3), 2))
    with pytest.raises(ValueError, match=r"^unit: expected a main axis of 0, 1 or 2, got 3"):
        states(unit=(none, none, none, np.zeros(3), 3))


def test_levelled_states_keep_the_strength_of_gravity(states):
    gravity = states(gravity=(3.0, 0.0, 4.0)).levelled().gravity
    assert gravity == pytest.approx([0.0, 0.0, 5.0])


@pytest.mark.parametrize("dt", [0.0, -0.01, NAN, float("inf")])
def test_the_interval_of_samples_must_be_positive(flight, dt):
    with pytest.raises(ValueError, match="sample interval must be positive"):
        _core.Samples(0.0, dt, flight.positions, flight.quats)


def test_times_of_samples_must_be_finite(flight, samples, states):
    with pytest.raises(ValueError, match=r"^start: "):
        _core.Samples(NAN, 0.01, flight.positions, flight.quats)
    with pytest.raises(ValueError, match=r"^time: "):
        samples.position_at(NAN)
    for until in (NAN, float("inf")):
        with pytest.raises(ValueError, match=r"^until: "):
            samples.extended(None, states(), until)


def test_samples_go_on_at_constant_velocity_without_an_imu(samples, states):
    longer, n_blind = samples.extended(None, states(), samples.end + 0.1)
    assert n_blind == 0
    assert longer.end == pytest.approx(samples.end + 0.1)
    steps = np.diff(longer.positions, axis=0)
    assert steps[-10:] == pytest.approx(np.tile(steps[-11], (10, 1)))


def test_extending_backwards_changes_nothing(samples, states):
    same, _ = samples.extended(None, states(), samples.start)
    assert same.positions.tobytes() == samples.positions.tobytes()


@pytest.mark.parametrize("bounds", [(3, 3), (4, 3), (0, 10**6)])
def test_samples_are_not_cut_outside(samples, bounds):
    with pytest.raises(ValueError, match="cannot be cut"):
        samples.slice(*bounds)


def test_a_cut_can_be_put_back(samples):
    part = samples.slice(5, len(samples) - 1)
    whole = samples.replaced(5, part)
    assert whole.positions.tobytes() == samples.positions.tobytes()
    assert whole.quats_xyzw == pytest.approx(samples.quats_xyzw, abs=1e-15)


def test_samples_are_not_replaced_beyond_their_end_or_at_another_rate(samples, flight):
    with pytest.raises(ValueError, match=r"^first: expected at most"):
        samples.replaced(len(samples) + 1, samples)
    coarse = _core.Samples(0.0, 0.5, flight.positions, flight.quats)
    with pytest.raises(ValueError, match=r"^newer: expected samples every 0.01 s"):
        samples.replaced(3, coarse)


def test_a_head_with_a_motor_needs_its_angles(flight, samples, states, extract):
    points, stamps = flight.points[:9], flight.stamps[:9]
    with pytest.raises(ValueError, match=r"^angles: expected the motor's angle"):
        samples.place(points, stamps, None, states(**MOTOR))
    with pytest.raises(ValueError, match=r"^angles: expected the motor's angle"):
        extract(globals=states(**MOTOR))
    assert samples.place(points, stamps, np.zeros(9), states(**MOTOR)).shape == (9, 3)


def test_points_are_placed_nearer_by_what_ranges_are_too_long(flight, drifted, states):
    points, stamps = flight.points[:9], flight.stamps[:9]
    placed = drifted.place(points, stamps, None, states(ranges=(0.02, 0.0)))
    far = np.linalg.norm(points, axis=1)[:, None]
    expected = drifted.place(points * (1.0 - 0.02 / far), stamps, None, states())
    assert np.allclose(placed, expected, atol=1e-12)


def test_settings_without_a_field_are_refused(extract):
    with pytest.raises(AttributeError, match="voxel_size"):
        extract(settings=RegistrationSettings())


def test_information_must_be_square(register):
    for n in (N_STATES - 1, N_STATES + 1):
        with pytest.raises(ValueError, match=r"^information: expected shape \(57, 57\), got "):
            register(surfels=[], information=np.resize(1e6 * np.eye(N_STATES), (n, N_STATES)))


def test_every_slow_state_is_frozen_or_not(register):
    with pytest.raises(ValueError, match=f"length {N_STATES}"):
        register(surfels=[], frozen=[True] * (N_STATES - 1))


@pytest.mark.parametrize("threads", [-1, 1.5])
def test_a_number_of_threads_is_a_count(extract, threads):
    with pytest.raises((OverflowError, TypeError)):
        extract(threads=threads)


def test_a_view_holds_the_surfels_of_its_time_only(extract, samples, states):
    surfels = extract()
    view = _core.FixedView([surfels], 0.5, 1.0, samples, states())
    inside = (surfels.stamps >= 0.5) & (surfels.stamps < 1.0)
    assert 0 < len(view) == inside.sum()
    assert len(_core.FixedView([], 0.0, 1.0, samples, states())) == 0
