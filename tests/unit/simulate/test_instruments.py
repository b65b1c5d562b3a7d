# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.evaluate.alignment import align
from bentwing.simulate.instruments import (
    TerrestrialErrors,
    TotalStation,
    choose_stations,
    scan,
    track,
)
from bentwing.simulate.instruments.places import sees, standing_places
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.scenes import Site, World
from bentwing.simulate.scenes.mesh import box, merge
from bentwing.simulate.simulation import prepare

EXACT = TerrestrialErrors(bias=0.0, sigma=0.0, station_sigma=0.0, station_turn=0.0)
STILL = TotalStation(sigma=0.0, measuring_time=0.0, clock_offset=1.5)


@pytest.fixture(scope="module")
def setup():
    return prepare(Scenario(scene="courtyard", duration=30.0, seed=2))


def prisms(setup, times, station):
    motion = setup.rig.imu(times)
    return motion.p + motion.R @ np.array(station.prism)


def residuals(setup, station, seed=0):
    """Distances of the measurements from the prism after a rigid motion, and speeds of the carrier."""
    seen = track(setup.world, setup.rig, (0.0, 30.0), np.random.default_rng(seed), station)
    times = seen.times - station.clock_offset
    true = prisms(setup, times, station)
    moved = align(seen.positions, true)
    errors = np.linalg.norm(seen.positions @ moved.R.T + moved.t - true, axis=1)
    return errors, np.linalg.norm(setup.rig.carrier.motion(times).v, axis=1), seen


def test_a_perfect_total_station_sees_the_prism_where_it_is_in_a_level_frame(setup):
    errors, _, seen = residuals(setup, STILL)
    assert errors.max() < 1e-9
    assert seen.share_seen > 0.7
    true = prisms(setup, seen.times - 1.5, STILL)
    np.testing.assert_allclose(np.ptp(seen.positions[:, 2]), np.ptp(true[:, 2]), atol=1e-9)


def test_the_error_of_a_total_station_grows_with_speed(setup):
    errors, speeds, _ = residuals(setup, TotalStation())
    slow, fast = errors[speeds < 0.02], errors[speeds > 0.8]
    assert len(slow) > 10
    assert len(fast) > 10
    # at rest three coordinates of 3 mm, and the alignment takes some of it
    assert np.median(slow) < 0.015
    # read anywhere within 0.15 s: 43 mm of standard deviation per m/s and coordinate along the way
    assert 0.02 < np.median(fast) < 0.12


def test_terrestrial_scans_lie_on_the_surfaces(setup):
    rng = np.random.default_rng(1)
    stations = choose_stations(setup.world, rng, 2, EXACT)
    assert np.linalg.norm(stations[0].place - stations[1].place) > 2.0
    points = np.concatenate(list(scan(setup.world, stations[0], np.radians(2.0), rng, EXACT)))
    assert len(points) > 3000
    assert np.abs(setup.world.scene.distance(np.ascontiguousarray(points))[0]).max() < 1e-6


def test_the_errors_of_a_terrestrial_scan_are_those_it_is_told(setup):
    rng = np.random.default_rng(1)
    errors = TerrestrialErrors(bias=0.0, sigma=0.005, station_sigma=0.0, station_turn=0.0)
    station = choose_stations(setup.world, rng, 1, errors)[0]
    noisy, exact = (
        np.concatenate(list(scan(setup.world, station, 0.02, np.random.default_rng(3), e)))
        for e in (errors, EXACT)
    )
    offsets = np.linalg.norm(noisy - station.place, axis=1) - np.linalg.norm(
        exact - station.place, axis=1
    )
    assert offsets.std() == pytest.approx(0.005, rel=0.05)


def test_stations_complete_each_other(setup):
    rng = np.random.default_rng(4)
    stations = choose_stations(setup.world, rng, 4, EXACT)
    targets = np.concatenate(
        [np.concatenate(list(scan(setup.world, s, 0.05, rng, EXACT))) for s in stations]
    )
    targets = np.ascontiguousarray(targets)
    seen = [sees(setup.world, s.place, targets, 0.02) for s in stations]
    assert np.any(seen, axis=0).mean() > seen[0].mean()


def test_a_wall_hides_what_is_behind_it():
    wall = World(Site(merge([box((4, -5, 0), (4.2, 5, 3))]), (0, -2, 1), (8, 2, 2), 0.1, 1.0))
    targets = np.array([[3.0, 0.0, 1.0], [6.0, 0.0, 1.0]])
    assert sees(wall, np.array([0.0, 0.0, 1.0]), targets, 0.0).tolist() == [True, False]


def test_without_ground_there_is_no_place_to_stand():
    floating = World(Site(merge([box((0, 0, 50), (1, 1, 51))]), (0, -2, 1), (8, 2, 2), 0.1, 1.0))
    with pytest.raises(UsageError, match="tripod"):
        standing_places(floating, np.random.default_rng(0), 3)
