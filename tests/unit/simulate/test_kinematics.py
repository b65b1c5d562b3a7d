# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from bentwing.simulate.kinematics import (
    Nodes,
    apply,
    rotation,
    translating,
)
from bentwing.simulate.splines import DEGREE, Spline

TIMES = np.linspace(1.0, 3.0, 41)


def random_motion(rng):
    """A frame at the end of a translation, two turns and a mount."""
    way = Spline(0.2, rng.normal(size=(30, 3)))
    angles = [Spline(0.15, np.cumsum(rng.normal(size=(40, 1)), axis=0)) for _ in range(2)]
    R, t = rotation(rng.normal(size=(1, 3)))[0], rng.normal(size=3)

    def motion(times):
        frame = translating(way, times).turned(np.array([0.0, 0.6, 0.8]), angles[0], times)
        return frame.mounted(R, t).turned(np.array([1.0, 0.0, 0.0]), angles[1], times)

    return motion


def test_velocity_and_acceleration_are_the_derivatives_of_position(rng):
    motion, h = random_motion(rng), 1e-5
    before, now, after = (motion(TIMES + d) for d in (-h, 0.0, h))
    np.testing.assert_allclose(now.v, (after.p - before.p) / (2 * h), atol=1e-5)
    np.testing.assert_allclose(now.a, (after.v - before.v) / (2 * h), atol=1e-4)


def test_rates_are_the_derivatives_of_the_rotation_in_the_frame_itself(rng):
    motion, h = random_motion(rng), 1e-5
    before, now, after = (motion(TIMES + d) for d in (-h, 0.0, h))
    turned = Rotation.from_matrix(before.R.transpose(0, 2, 1) @ after.R).as_rotvec()
    np.testing.assert_allclose(now.omega, turned / (2 * h), atol=1e-5)
    np.testing.assert_allclose(now.alpha, (after.omega - before.omega) / (2 * h), atol=1e-4)


def test_poses_between_nodes_are_exact_to_micrometres(rng):
    motion, vectors = random_motion(rng), rng.normal(size=(41, 3))
    nodes = Nodes(0.9, 1e-3, motion(0.9 + 1e-3 * np.arange(2300)))
    times = TIMES + 0.000413
    origins, turned = nodes.place(times, vectors)
    exact = motion(times)
    np.testing.assert_allclose(origins, exact.p, atol=1e-6)
    np.testing.assert_allclose(turned, apply(exact.R, vectors), atol=1e-6)


def test_rotations_agree_with_scipy_at_all_angles(rng):
    phi = rng.normal(size=(500, 3)) * np.geomspace(1e-9, 2.0, 500)[:, None]
    phi = np.vstack([phi, [[np.pi, 0, 0], [0, np.pi, 0], [0, 0, np.pi], [0, 0, 0]]])
    R = rotation(phi)
    np.testing.assert_allclose(R, Rotation.from_rotvec(phi).as_matrix(), atol=1e-14)


def test_a_spline_and_its_derivatives_agree_with_scipy(rng):
    controls = rng.normal(size=(20, 1))
    knots = (np.arange(20 + DEGREE + 1) - (DEGREE + 1) / 2) * 0.5
    reference = BSpline(knots, controls[:, 0], DEGREE)
    times = np.linspace(1.5, 7.5, 100)
    for k in range(4):
        ours = Spline(0.5, controls)(times, k)[:, 0]
        np.testing.assert_allclose(ours, reference(times, nu=k), atol=1e-10)


def test_a_spline_through_equal_controls_does_not_move():
    still = Spline(0.5, np.full((20, 1), 0.1))(np.linspace(0.0, 9.0, 1000))
    assert np.ptp(still) < 1e-15
