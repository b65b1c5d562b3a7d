# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar turns and moves through a box; its trajectory is disturbed and has to come back."""

import numpy as np
import pytest

from bentwing import register_window
from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.continuous.settings import ContinuousSettings, SurfelSettings
from bentwing.recording import Payload

LOW, HIGH = np.array([-5.0, -4.0, -1.2]), np.array([5.0, 4.0, 2.0])  # m, corners of the box
DURATION = 3.0  # s
RANGE_SIGMA = 0.005  # m
# Without an IMU everything rests on the surfels, and the noise of the default number of them is more
# than the bounds below, which are those of the registration itself.
SETTINGS = ContinuousSettings(surfels=SurfelSettings(max_rate=1e5))
PAYLOAD = Payload.model_validate({"lidar": {"range_sigma": RANGE_SIGMA}, "imu": None})


def truth():
    t = np.arange(0, DURATION + 0.1, 0.01)
    positions = np.stack([0.8 * np.sin(t), 0.5 * t - 0.7, 0.2 * np.sin(2 * t)], axis=1)
    turns = np.stack([0.1 * np.sin(2 * t), 0.1 * np.cos(3 * t), 0.6 * t], axis=1)
    return Trajectory(t, positions, geometry.exp(turns))


def seen(trajectory, n=60_000):
    """Returns of a lidar of 16 beams that turns ten times a second."""
    rng = np.random.default_rng(4)
    times = np.sort(rng.uniform(0, DURATION, n))
    azimuth, elevation = 2 * np.pi * 10 * times, np.radians(rng.integers(-15, 16, n))
    rays = np.stack(
        [
            np.cos(elevation) * np.cos(azimuth),
            np.cos(elevation) * np.sin(azimuth),
            np.sin(elevation),
        ],
        1,
    )
    positions, quats = trajectory.interpolate(times)
    along = geometry.rotate(quats, rays)
    with np.errstate(divide="ignore"):
        ranges = np.where(along > 0, (HIGH - positions) / along, (LOW - positions) / along).min(
            axis=1
        )
    return rays * (ranges + rng.normal(0, RANGE_SIGMA, n))[:, None], times


def disturbed(trajectory):
    """The trajectory with an error that grows to 6 cm and 0.6°."""
    share = (trajectory.times / DURATION)[:, None] ** 2
    turns = geometry.exp(share * [0.004, -0.006, 0.008])
    return Trajectory(
        trajectory.times,
        trajectory.positions + share * [0.04, -0.03, 0.03],
        geometry.multiply(turns, trajectory.quats_xyzw),
    )


def error_of(trajectory):
    return np.linalg.norm(trajectory.positions - truth().positions, axis=1)[:300]


def test_a_disturbed_trajectory_comes_back():
    points, times = seen(truth())
    prior = disturbed(truth())
    result = register_window(points, times, prior, payload=PAYLOAD, settings=SETTINGS)
    assert error_of(prior).max() > 0.05
    # Planes of hundreds of returns with 5 mm of noise each.
    assert error_of(result.trajectory).max() < 0.005
    assert result.converged
    assert result.n_matches > 100
    assert 0.3 < result.residual_rms < 2.0
    assert result.inlier_share > 0.8
    assert result.calibration.std == {}


def test_points_that_are_stamped_late_are_taken_back_by_the_latency_of_the_payload():
    points, times = seen(truth())
    late = PAYLOAD.model_copy(update={"lidar": PAYLOAD.lidar.model_copy(update={"latency": 0.05})})
    prior = disturbed(truth())
    in_time = register_window(points, times, prior, payload=PAYLOAD, settings=SETTINGS)
    result = register_window(points, times + 0.05, prior, payload=late, settings=SETTINGS)
    assert result.calibration.latency == 0.05
    assert np.abs(result.trajectory.positions - in_time.trajectory.positions).max() < 1e-3


def test_an_earlier_window_holds_a_later_one():
    points, times = seen(truth())
    early, late = times < 1.5, times >= 1.5
    head = {"payload": PAYLOAD, "settings": SETTINGS}
    first = register_window(points[early], times[early], truth(), **head)
    shifted = Trajectory(
        truth().times, truth().positions + np.array([0.03, 0.02, 0.0]), truth().quats_xyzw
    )
    loose = register_window(points[late], times[late], shifted, **head)
    held = register_window(
        points[late], times[late], shifted, **head, fixed_views=[first.fixed_view()]
    )
    at_the_end = slice(250, 300)
    assert held.n_fixed_matches > 100 > loose.n_fixed_matches == 0
    assert error_of(held.trajectory)[at_the_end].max() < 0.01
    assert error_of(loose.trajectory)[at_the_end].min() > 0.02


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"points": np.zeros((5, 2))}, r"points: expected shape \(N, 3\)"),
        ({"times": np.array([0.5, 0.4, 0.6, 0.7, 0.8])}, "times|stamps: must not decrease"),
        ({"times": np.linspace(1, 9, 5)}, "within the prior trajectory"),
        ({"times": np.empty(0), "points": np.empty((0, 3))}, "at least one"),
    ],
)
def test_arguments_that_do_not_fit_are_named(changes, sentence):
    arguments = {"points": np.ones((5, 3)), "times": np.linspace(0.5, 0.9, 5), **changes}
    with pytest.raises(ValueError, match=sentence):
        register_window(arguments["points"], arguments["times"], truth())
