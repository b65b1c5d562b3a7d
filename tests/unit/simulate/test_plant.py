# SPDX-License-Identifier: MIT OR Apache-2.0
"""The findings of Kaul 2015, sections 3.2 and 5, follow from the plant."""

from __future__ import annotations

import functools
from dataclasses import replace

import numpy as np
import pytest

from bentwing.flight.control import SpinSettings
from bentwing.simulate.plant.airflow import ROTORS, Air, downdraft, induced
from bentwing.simulate.plant.drives import FREE_RATE, STRAIGHT, held
from bentwing.simulate.plant.flights import Drive, fly
from bentwing.simulate.plant.head import SpunHead, driving_force
from bentwing.simulate.plant.outcomes import outcomes
from bentwing.simulate.plant.parameters import Carrier, Flow, PlantSettings, Vanes
from bentwing.simulate.plant.weather import Weather
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.simulation import prepare

CALM = Weather(max_wind=1e-9, max_mean=1e-9, max_speed=0.0, max_climb=0.0, max_descent=0.0)
PLANNED = np.radians([150.0, 460.0])
STARTS = np.radians(np.arange(0.0, 360.0, 10.0))


def still(n=1, *, wind=(0.0, 0.0), climb=0.0):
    return Air(np.tile(wind, (n, 1)), np.full(n, climb), np.ones(n), np.zeros((n, 4)))


def turned(plant, degrees, *, starts=STARTS, seconds=8.0):
    """Rates of heads from all starts after some seconds in calm air at fixed vanes."""
    head, air = SpunHead(plant, starts), still(len(starts))
    for _ in range(round(seconds / 0.01)):
        head.step(air, np.full(len(starts), np.radians(degrees)), 0.01)
    return np.degrees(head.rate)


def test_hover_and_level_flight_satisfy_momentum_theory():
    carrier = Carrier()
    assert induced(carrier, still())[0] == pytest.approx(carrier.hover_induced)
    v = induced(carrier, still(wind=(6.0, 0.0)))[0]
    assert v * np.hypot(6.0, v) == pytest.approx(carrier.hover_induced**2)
    climbing = induced(carrier, still(climb=2.0))[0]
    assert climbing * (climbing + 2.0) == pytest.approx(carrier.hover_induced**2)


def test_the_downdraft_is_under_the_rotors_and_hardly_between_them():
    carrier, flow = Carrier(), Flow()
    angles = np.concatenate([ROTORS + 0.15, ROTORS + np.pi / 4])
    places = 0.38 * np.column_stack([np.cos(angles), np.sin(angles)])[None]
    speeds = downdraft(carrier, flow, still(), places)[0]
    assert speeds[:4].min() > 7.0
    assert speeds[4:].max() < 0.06 * speeds[:4].min()


def test_wind_leans_the_wakes_over():
    place = np.array([[[carrier_arm(), 0.0]]])  # in the gap ahead
    calm = downdraft(Carrier(), Flow(), still(), place)[0, 0]
    # From the right and behind, the wake of the right rotor ahead comes into the gap.
    leaning = downdraft(Carrier(), Flow(), still(wind=(3.0, 10.0)), place)[0, 0]
    assert leaning > 3.0 * calm


def carrier_arm():
    return PlantSettings().head.arm


def test_the_force_on_the_vanes_has_the_symmetry_of_a_plate():
    vanes = replace(Vanes(), frame_area=0.0)
    angles = np.radians([10.0, 30.0, 60.0])
    forward = driving_force(vanes, angles, np.zeros(3), np.full(3, 10.0))
    backward = driving_force(vanes, -angles, np.zeros(3), np.full(3, 10.0))
    np.testing.assert_allclose(forward, -backward)
    assert (forward > 0).all()
    assert forward[1] > forward[2]  # a plate across the flow drags more than it drives


def test_arms_at_135_degrees_start_from_every_position():
    assert turned(PlantSettings(), 45.0).min() > 500.0


def test_arms_at_180_degrees_do_not_start_in_the_gaps_but_under_rotors():
    rates = turned(STRAIGHT, 45.0)
    in_gaps = np.abs(np.degrees(STARTS) % 90.0) < 1.0
    assert abs(rates[in_gaps]).max() == 0.0
    assert rates[np.abs(np.degrees(STARTS) % 90.0 - 40.0) < 1.0].min() > 500.0


def test_the_map_gain_holds_the_rate_in_calm_hover():
    settings = SpinSettings()
    for rate_deg in (180.0, 300.0, 540.0):
        angle = np.degrees(settings.map_gain * np.radians(rate_deg))
        rates = turned(PlantSettings(), angle, starts=np.array([0.3]), seconds=15.0)
        assert rates[0] == pytest.approx(rate_deg, rel=0.08)


@functools.cache
def flown(drive_name):
    drives = {
        "controller": Drive(),
        "no control": held(np.radians(280.0)),
        "straight": Drive(plant=STRAIGHT),
        "free": held(FREE_RATE),
    }
    free = drive_name == "free"
    return fly(
        drives[drive_name],
        Weather(),
        n=24,
        duration=40.0,
        seed=3,
        desired=FREE_RATE if free else np.radians(280.0),
    )


def test_in_gusts_the_controller_holds_the_rate_and_fixed_vanes_do_not():
    ours, fixed = (outcomes(flown(name), *PLANNED) for name in ("controller", "no control"))
    assert ours.in_range > 0.97
    assert fixed.in_range < ours.in_range - 0.1
    assert fixed.kept < ours.kept


@pytest.mark.slow
def test_in_gusts_straight_arms_stall():
    straight = outcomes(flown("straight"), *PLANNED)
    assert straight.kept < outcomes(flown("controller"), *PLANNED).kept


@pytest.mark.slow
def test_free_spinning_at_two_to_three_hertz_hardly_ever_stalls():
    free = outcomes(flown("free"), *PLANNED)
    assert free.kept > outcomes(flown("no control"), *PLANNED).kept
    assert np.degrees(free.percentiles[1]) == pytest.approx(900.0, rel=0.1)


def test_stall_prevention_overshoots_a_rate_just_above_its_threshold():
    loose = SpinSettings(proportional_gain=0.02)
    windy = Weather(max_mean=4.0, gust_interval=8.0)
    how = {"n": 8, "duration": 25.0, "seed": 5, "desired": np.radians(200.0)}
    with_it = fly(Drive(loose), windy, **how)
    without = fly(Drive(replace(loose, stall_angle=1e-12)), windy, **how)
    after = with_it.times > 15.0
    assert np.percentile(with_it.rates[after], 99) > np.percentile(without.rates[after], 99) * 1.15


def test_the_same_seed_gives_the_same_flights():
    first, second = (fly(Drive(), Weather(), n=3, duration=4.0, seed=8) for _ in "ab")
    np.testing.assert_array_equal(first.rates, second.rates)


def test_the_wind_never_exceeds_its_limit():
    from bentwing.simulate.plant.weather import Conditions

    weather = Weather(max_speed=0.0)
    conditions = Conditions(weather, 50, 0.02, np.random.default_rng(1), 0.08)
    winds = [np.linalg.norm(conditions.next()[0].wind, axis=1).max() for _ in range(1500)]
    assert 4.0 < max(winds) <= weather.max_wind + 1e-9


@pytest.mark.parametrize("event", ["none", "spin-stall"])
def test_a_scenario_can_take_its_spin_from_the_plant(event):
    events = () if event == "none" else (event,)
    setup = prepare(Scenario(scene="courtyard", duration=40.0, events=events, spin="plant"))
    times = np.arange(0.0, 40.0, 0.05)
    spin = setup.rig.imu(times).omega[:, 2] - setup.rig.carrier.motion(times).omega[:, 2]
    assert abs(spin[times < 3.0]).max() == pytest.approx(0.0, abs=1e-9)
    flight = (times > 12.0) & (times < 20.0)
    assert np.degrees(spin[flight]).min() > 150.0
    assert np.degrees(spin[flight]).max() < 460.0
    middle = abs(times - 24.5) < 0.5
    assert (abs(spin[middle]).max() < 0.1) == (event == "spin-stall")
