# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar turns and moves through a box; its trajectory is disturbed and has to come back."""

import copy
import pickle

import numpy as np
import pytest

from bentwing import NotEnoughDataError, Payload, Trajectory, register_window
from bentwing.base import geometry
from bentwing.odometry import ContinuousSettings, SurfelSettings
from bentwing.recording import ImuBatch

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


def test_the_covariances_say_where_the_correction_is_certain():
    points, times = seen(truth())
    head = {"payload": PAYLOAD, "settings": SETTINGS}
    covariances = register_window(points, times, disturbed(truth()), **head).covariances
    assert covariances.shape == (len(truth().times), 6, 6)
    np.testing.assert_array_equal(covariances, covariances.transpose(0, 2, 1))
    assert np.linalg.eigvalsh(covariances).min() > 0
    # The first pose is held to 10 µrad and 0.1 mm.
    std = np.sqrt(np.diagonal(covariances, axis1=1, axis2=2))
    np.testing.assert_array_less(std[0], 1.001 * np.repeat([1e-5, 1e-4], 3))
    # Behind the last point nothing but the prior's velocity says where the lidar is.
    assert (std[-1, 3:] > std[len(std) // 2, 3:]).all()
    joined = register_window(points, times, truth(), **head, continues=True).covariances
    assert not joined[0].any()
    assert joined[60:].any(axis=(1, 2)).all()


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


@pytest.fixture(scope="module")
def window():
    points, times = seen(truth())
    return register_window(points, times, disturbed(truth()), payload=PAYLOAD, settings=SETTINGS)


def copied(value):
    return copy.deepcopy(value)


def pickled(value):
    return pickle.loads(pickle.dumps(value))


@pytest.mark.parametrize("again", [copied, pickled])
def test_copies_and_pickles_equal_it_and_hold_a_later_window_just_as_well(window, again):
    other = again(window)
    assert other == window
    points, times = seen(truth(), 20_000)
    held = [
        register_window(points, times, truth(), payload=PAYLOAD, fixed_views=[view])
        for view in (window.fixed_view(0.0, 1.5), again(window.fixed_view(0.0, 1.5)))
    ]
    assert held[0].n_fixed_matches == held[1].n_fixed_matches > 50
    # Quaternions are made unit again, which rounds.
    assert np.allclose(held[0].trajectory.positions, held[1].trajectory.positions, atol=1e-9)


def test_comparing_never_raises(window):
    assert window == window
    assert window != 3
    assert window.fixed_view() != window.fixed_view(0.0, 1.0)


def frozen(array):
    array.setflags(write=False)
    return array


@pytest.mark.parametrize(
    "form",
    [
        lambda array: array.tolist(),
        lambda array: np.repeat(array, 2, axis=0)[::2],
        np.asfortranarray,
        frozen,
    ],
    ids=["lists", "views", "columns first", "read-only"],
)
def test_arrays_in_any_form_give_the_same(form):
    points, times = seen(truth(), 8_000)
    result = register_window(points, times, truth(), payload=PAYLOAD)
    assert register_window(form(points), form(times), truth(), payload=PAYLOAD) == result


def test_single_precision_is_taken():
    points, times = seen(truth(), 8_000)
    result = register_window(points.astype(np.float32), times, truth(), payload=PAYLOAD)
    assert result.n_matches > 50


def test_a_payload_may_be_given_by_its_file(tmp_path):
    path = tmp_path / "payload.yaml"
    path.write_text(f"lidar: {{range_sigma: {RANGE_SIGMA}}}\nimu: null\n")
    points, times = seen(truth(), 8_000)
    by_value = register_window(points, times, truth(), payload=PAYLOAD)
    assert register_window(points, times, truth(), payload=path) == by_value
    assert register_window(points, times, truth(), payload=str(path)) == by_value


def in_unit(per_second):
    """The prior with times in another unit than seconds."""
    prior = truth()
    return Trajectory(per_second * prior.times, prior.positions, prior.quats_xyzw)


def scattered(n=50):
    rng = np.random.default_rng(0)
    return rng.uniform(-5, 5, (n, 3)), np.sort(rng.uniform(0, DURATION, n))


def in_millimetres():
    points, times = seen(truth(), 8_000)
    return 1e3 * points, times


@pytest.mark.parametrize("given", [scattered, in_millimetres])
def test_points_that_say_nothing_are_refused_with_what_was_found(given):
    with pytest.raises(
        NotEnoughDataError, match=r"points: \d+ over .* make \d+ surfels.*in metres"
    ):
        register_window(*given(), truth(), payload=PAYLOAD)


IMU = ImuBatch(np.arange(0, 3.1, 0.01), np.zeros((310, 3)), np.tile([0.0, 0.0, 9.8], (310, 1)))
MOTOR = Payload.model_validate({"encoder": {}})


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        (
            {"points": np.zeros((5, 2))},
            ValueError,
            r"points: expected shape \(N, 3\), got \(5, 2\)",
        ),
        ({"points": np.full((5, 3), np.nan)}, ValueError, "points: row 0 is not finite"),
        (
            {"points": "cloud.laz"},
            TypeError,
            r"points: expected numbers of shape \(N, 3\), got str",
        ),
        ({"times": np.array([0.5, 0.4, 0.6, 0.7, 0.8])}, ValueError, "times: must not decrease"),
        ({"times": np.linspace(1, 9, 5)}, ValueError, "times: .* within the prior trajectory"),
        ({"times": np.linspace(1, 2, 4)}, ValueError, r"times: expected shape \(5,\), got \(4,\)"),
        ({"times": [], "points": np.empty((0, 3))}, ValueError, "times: expected at least one"),
        ({"prior": np.eye(4)}, TypeError, r"prior: expected a Trajectory, got ndarray; make one"),
        ({"prior": truth()[:1]}, ValueError, "prior: .* at least two poses"),
        ({"prior": truth()[np.arange(310) % 7 > 0]}, ValueError, "prior: .* resample it"),
        ({"prior": truth()[::10]}, ValueError, r"prior: a pose every 0.1 s .* resample it"),
        ({"prior": truth()[::50]}, ValueError, r"prior: a pose every 0.5 s .* resample it"),
        ({"prior": in_unit(1e6), "times": np.linspace(5e5, 9e5, 5)}, ValueError, "in seconds"),
        ({"prior": in_unit(1e9), "times": np.linspace(5e8, 9e8, 5)}, ValueError, "in seconds"),
        ({"angles": np.zeros(4)}, ValueError, r"angles: expected shape \(5,\), got \(4,\)"),
        ({"payload": MOTOR}, ValueError, "angles: expected the motor's angle at each of the 5"),
        ({"imu": (1, 2, 3)}, TypeError, "imu: expected an ImuBatch, got tuple; make one"),
        ({"imu": IMU.where(slice(0, 0))}, ValueError, "imu: expected samples over the prior"),
        (
            {"imu": ImuBatch(IMU.times[::-1], IMU.gyro, IMU.accel)},
            ValueError,
            "imu.times: must not decrease",
        ),
        ({"imu": ImuBatch(IMU.times, IMU.gyro[1:], IMU.accel)}, ValueError, "imu.gyro: expected"),
        ({"fixed_views": 3}, TypeError, "fixed_views: expected a list, got int"),
        ({"fixed_views": [3]}, TypeError, "fixed_views: expected a FixedView, got int"),
        ({"payload": 3}, TypeError, "payload: expected a Payload, got int; give the path"),
        ({"calibration": {}}, TypeError, "calibration: expected a Calibration, got dict"),
        ({"settings": {}}, TypeError, "settings: expected a ContinuousSettings, got dict; make"),
        ({"threads": 0}, ValueError, "threads: expected a number from 1 to 1024, or None"),
        ({"threads": "all"}, TypeError, "threads: expected an int, got str"),
    ],
)
def test_arguments_that_do_not_fit_are_named(changes, error, sentence):
    arguments = {
        "points": np.ones((5, 3)), "times": np.linspace(0.5, 0.9, 5), "prior": truth(), **changes
    }  # fmt: skip
    points, times, prior = (arguments.pop(name) for name in ("points", "times", "prior"))
    with pytest.raises(error, match=sentence):
        register_window(points, times, prior, **arguments)
