# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bentwing.base.errors import NotEnoughDataError
from bentwing.closing.georeference.placement import Placement, Positions, Surfaces, _step, place

SIGMAS = np.array([0.02, 0.02, 0.04])


def positions(heading, shift, n=200, outliers=0.0, seed=0, size=20.0):
    rng = np.random.default_rng(seed)
    points = np.cumsum(rng.normal(0, size / np.sqrt(n), (n, 3)), axis=0)
    true = Placement(heading, np.asarray(shift, float), np.zeros(4))
    targets = true.to_level(points) + SIGMAS * rng.normal(size=(n, 3))
    false = rng.random(n) < outliers
    targets[false] += rng.uniform(2, 30, (false.sum(), 1)) * rng.choice([-1, 1], (false.sum(), 3))
    return Positions(points, targets, np.tile(np.diag(SIGMAS**2), (n, 1, 1))), false


@settings(max_examples=25, deadline=None)
@given(st.floats(-3.14, 3.14), st.tuples(*[st.floats(-50, 50)] * 3), st.integers(0, 9))
def test_heading_and_place_are_found_among_false_fixes(heading, shift, seed):
    measured, false = positions(heading, shift, outliers=0.25, seed=seed)
    found, used = place(measured, Surfaces.none())
    turned = np.angle(np.exp(1j * (found.heading - heading)))
    assert abs(turned) < 5 * found.std[0]
    assert np.all(np.abs(found.translation - shift) < 5 * found.std[1:])
    assert found.std[0] < 2e-3
    assert not np.any(used & false)
    assert np.mean(used[~false]) > 0.97


def test_the_deviations_are_those_of_repeated_fits():
    fits = [place(positions(0.4, (1, 2, 3), seed=0)[0], Surfaces.none())[0]]
    headings = []
    points = positions(0.4, (1, 2, 3))[0].points
    for seed in range(60):
        rng = np.random.default_rng(seed)
        targets = fits[0].to_level(points) + SIGMAS * rng.normal(size=points.shape)
        covariances = np.tile(np.diag(SIGMAS**2), (len(points), 1, 1))
        headings.append(place(Positions(points, targets, covariances), Surfaces.none())[0].heading)
    assert 0.75 < np.std(headings) / fits[0].std[0] < 1.3


def test_fixes_with_common_errors_weigh_less():
    measured, _ = positions(0.4, (1, 2, 3))
    alone, _ = place(measured, Surfaces.none())
    shared = Positions(measured.points, measured.targets, measured.covariances, share=0.01)
    assert np.allclose(place(shared, Surfaces.none())[0].std, 10 * alone.std, rtol=1e-6)


def test_surfaces_alone_place_a_map_that_is_nearly_right():
    rng = np.random.default_rng(1)
    points = rng.uniform(-10, 10, (9, 3))
    normals = np.repeat(np.eye(3), 3, axis=0)
    true = Placement(0.03, np.array([0.2, -0.1, 0.05]), np.zeros(4))
    across = rng.normal(size=(9, 3))
    across -= np.einsum("ki,ki->k", across, normals @ true.rotation.T)[:, None] * (
        normals @ true.rotation.T
    )
    surfaces = Surfaces(points, normals, true.to_level(points) + 0.1 * across, np.full(9, 0.003))
    start = Placement(0.0, np.zeros(3), np.zeros(4))
    nothing = Positions(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3, 3)))
    found, _ = place(nothing, surfaces, start)
    assert np.abs(surfaces.offsets(found)).max() < 1e-9
    assert abs(found.heading - 0.03) < 1e-9


def test_the_step_is_the_derivative_of_the_offsets():
    rng = np.random.default_rng(2)
    at = Placement(0.7, rng.normal(size=3), np.zeros(4))
    normals = rng.normal(size=(6, 3))
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    surfaces = Surfaces(rng.normal(size=(6, 3)), normals, rng.normal(size=(6, 3)), np.ones(6))
    rows = []
    for k in range(4):
        change = 1e-6 * np.eye(4)[k]
        offsets = [
            surfaces.offsets(Placement(at.heading + s * change[0], at.translation + s * change[1:], at.std))
            for s in (1, -1)
        ]  # fmt: skip
        rows.append((offsets[0] - offsets[1]) / 2e-6)
    jacobian = np.array(rows).T
    nothing = Positions(np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 3, 3)))
    step, covariance = _step(nothing, np.empty(0, bool), 1.0, surfaces, at)
    assert np.allclose(np.linalg.inv(covariance), jacobian.T @ jacobian, atol=1e-6)
    assert np.allclose(covariance @ -(jacobian.T @ surfaces.offsets(at)), step, atol=1e-6)


def test_fixes_at_one_place_do_not_tell_the_heading():
    still = Positions(np.zeros((5, 3)), np.ones((5, 3)), np.tile(np.eye(3), (5, 1, 1)))
    with pytest.raises(NotEnoughDataError, match="do not follow"):
        place(still, Surfaces.none())
    with pytest.raises(NotEnoughDataError, match="at least 2"):
        place(Positions(np.zeros((1, 3)), np.ones((1, 3)), np.eye(3)[None]), Surfaces.none())
