# SPDX-License-Identifier: MIT OR Apache-2.0
"""Simulated flights of a spinning Hokuyo against the truth.

The bounds come from what an error does to the map. The lidar's ranges have σ = 10 mm:

- An error of the trajectory in flight of 3 mm adds, in quadrature, 5 % to the thickness of a wall
  that was seen along the whole flight. The ten flights in docs/benchmarks.md have
  at most 1.5 mm.
- The map may be 1.3 times as thick as the one made with the truth, since errors of the trajectory
  and of the calibration come together; those flights have at most 1.07.
- The payload turns at 5 rad/s: half a millisecond of latency moves a point at 5 m by 12 mm, as much
  as the noise of its range.
- A map that is levelled by the start alone is tilted by 3.5 to 7 mrad (the accelerometer's bias
  across gravity); half of the least of it shows that the estimate of gravity is used.
"""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import in_flight
from bentwing.evaluate.trajectory import absolute_error

RANGE_SIGMA = 0.01  # m
FLIGHTS = [("courtyard", 30.0), ("office", 30.0)]
SEEDS = [1, 2, 3]


@pytest.fixture(params=FLIGHTS, ids=[scene for scene, _ in FLIGHTS])
def flight(request, flown):
    return flown(*request.param)


def test_the_trajectory_in_flight_is_finer_than_the_range_noise(flight):
    assert flight.score.ate_flight < 0.3 * RANGE_SIGMA
    assert flight.score.worst < RANGE_SIGMA
    assert flight.score.rotation < 0.002  # rad; 10 mm at 5 m


def test_the_map_is_nearly_the_best_possible(flight):
    assert flight.score.map_ratio < 1.3
    assert flight.score.map_excluded < 0.005


def test_drift_over_ten_metres_is_a_fraction_of_a_millimetre_per_metre(flight):
    """Ten metres are as long as the flights; 3 mm over them are 0.3 mm/m in each direction."""
    assert flight.score.horizontal < 0.6e-3
    assert flight.score.vertical < 0.3e-3


def test_the_clocks_are_aligned(flight):
    assert abs(flight.score.latency) < 0.5e-3


def test_the_standard_deviation_of_the_latency_is_no_boast(flight):
    (std,) = flight.record["calibration"]["std"]["latency"]
    assert abs(flight.score.latency) < 4 * std
    assert std < 0.5e-3


def test_the_map_is_level(flight):
    assert flight.score.tilt < 2e-3


def test_the_gyro_is_calibrated(flight):
    """The bias is drawn with several mrad/s, and is confounded with the extrinsics' tilt."""
    assert flight.score.gyro_bias < 1e-3


def test_the_whole_trajectory_is_found_also_before_the_payload_turns(flight):
    """At rest one scan plane says little: what the IMU makes of these seconds with the accelerometer
    bias of the first windows would be centimetres."""
    assert flight.score.ate < RANGE_SIGMA


def test_what_was_done_with_every_return_is_counted(flight):
    counts = flight.record["counts"]
    dropped = ("lidar.nan", "lidar.inf", "preprocess.range", "preprocess.self_hits")
    left = counts["lidar.returns"] - sum(counts.get(name, 0) for name in dropped)
    assert (
        counts["map.points"] + counts["map.outside_trajectory"] + counts["map.not_finite"] == left
    )


def test_healthy_windows_are_no_cause_for_alarm(flight):
    """Surfels average many ranges, so that their residuals are below the noise of a single one."""
    flying = [w for w in flight.record["windows"] if w["time"] > 8.0]
    assert not any(w["degenerate"] for w in flying)
    assert np.median([w["residual_rms"] for w in flying]) < 1.0
    assert np.median([w["inlier_share"] for w in flying]) > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("scene", ["courtyard", "office", "forest", "cave"])
def test_a_minute_in_flight_with_a_spinning_scanner(flown, scene, seed):
    """Twice the length, twice the bound; a forest has no walls, so that its surfels are fewer."""
    score = flown(scene, 60.0, seed=seed).score
    is_forest = scene == "forest"
    assert score.ate_flight < 0.3 * RANGE_SIGMA * (2 if is_forest else 1)
    assert score.map_ratio < (1.3 if is_forest else 1.2)
    assert abs(score.latency) < 0.4e-3
    assert score.horizontal < 1e-3
    assert score.vertical < 0.3e-3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("head", ["vlp16-fixed", "vlp16-motor"])
@pytest.mark.parametrize("scene", ["courtyard", "office"])
def test_a_minute_in_flight_with_a_multi_beam_scanner(flown, scene, head, seed):
    """Ranges have σ = 20 mm; the mount of the motor is uncertain by a quarter of a degree."""
    score = flown(scene, 60.0, seed=seed, head=head).score
    assert score.ate_flight < (0.01 if head == "vlp16-motor" else 0.008)
    assert score.map_ratio < 1.2
    assert score.horizontal < 1.2e-3
    assert score.vertical < 1e-3


@pytest.mark.slow
def test_a_motor_turns_otherwise_than_its_encoder_reads(flown):
    """With 0.17° of eccentricity and a shaft that wobbles by 0.1° it is as exact as without."""
    flight = flown("courtyard", 40.0, seed=171, head="vlp16-motor", realism=3.0, only=("motor",))
    drawn = yaml.safe_load((flight.recording / "truth_realism.yaml").read_text())["motor"][
        "encoder"
    ]
    phase = drawn["phase"]
    expected = -drawn["eccentricity"] * np.array([np.sin(phase), np.cos(phase)])
    encoder = flight.record["calibration"]["mount"]["encoder"]
    assert np.abs(np.array(encoder["eccentricity"]) - expected).max() < 3e-4
    assert flight.score.ate_flight < 0.007
    assert flight.score.horizontal < 1.2e-3


def test_closing_the_loops_improves_a_flight_that_comes_back(flown):
    # In flight: where the start was, relative to it, only the IMU says until the payload turns.
    flight = flown("cave", 40, seed=23)
    truth, origin_ns = read_tum(flight.recording / "truth_trajectory.txt")
    odometry, _ = read_tum(flight.out / "odometry.txt", origin_ns)
    open_loop = absolute_error(odometry, truth, during=in_flight(truth)).position.rmse
    assert flight.record["loop_closure"]["applied"]
    assert flight.score.ate_flight < open_loop
    assert flight.score.ate < 0.3 * RANGE_SIGMA


def test_expected_errors_are_about_as_large_as_the_true_ones(flight):
    """Twice the 68 % radius holds 95 % of the errors of an honest statement, three times it all."""
    expected = flight.record["expected_accuracy"]
    assert flight.score.worst < 3 * np.hypot(expected["horizontal"], expected["vertical"])
    assert expected["horizontal"] < 5 * RANGE_SIGMA


@pytest.mark.slow
def test_the_walls_of_a_cave_are_not_taken_for_errors_of_beams(flown):
    """Where all is rough, beams that seem to begin higher and lower shrink a climb by hundredths."""
    cave = flown("cave", 25.0, head="vlp16-fixed", seed=105)
    assert cave.record["beams"] is None
    assert cave.score.ate_flight < 0.005
