# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation, Slerp

from bentwing.base import geometry

vectors = arrays(np.float64, (4, 3), elements=st.floats(-3.0, 3.0, allow_subnormal=False))


@given(vectors)
def test_log_undoes_exp_below_half_a_turn(v):
    v = v * np.minimum(1.0, 3.1 / np.maximum(np.linalg.norm(v, axis=1, keepdims=True), 1e-300))
    assert np.allclose(geometry.log(geometry.exp(v)), v, atol=1e-12)


@given(vectors, vectors)
def test_rotating_and_multiplying_agree_with_matrices(v, p):
    q, r = geometry.exp(v), geometry.exp(v[::-1])
    matrices = geometry.to_matrices(geometry.multiply(q, r))
    expected = Rotation.from_rotvec(v).as_matrix() @ Rotation.from_rotvec(v[::-1]).as_matrix()
    assert np.allclose(matrices, expected, atol=1e-12)
    assert np.allclose(geometry.rotate(q, p), Rotation.from_rotvec(v).apply(p), atol=1e-12)


@given(vectors)
def test_matrices_go_back_to_the_same_rotation(v):
    q = geometry.exp(v)
    back = geometry.from_matrices(geometry.to_matrices(q))
    assert np.allclose(np.abs(np.sum(q * back, axis=1)), 1.0, atol=1e-12)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_survive_the_way_through_matrices(axis):
    half_turn = np.eye(4)[axis]
    back = geometry.from_matrices(geometry.to_matrices(half_turn))
    assert abs(half_turn @ back) == pytest.approx(1.0, abs=1e-15)


def test_slerp_turns_at_constant_rate_and_takes_the_shorter_way():
    rotations = Rotation.from_rotvec([[0.1, 0.2, 0.3], [0.4, -1.0, 0.5]])
    a, b = rotations.as_quat()
    shares = np.linspace(0, 1, 11)
    expected = Slerp([0, 1], rotations)(shares).as_matrix()
    for end in (b, -b):
        found = geometry.slerp(np.tile(a, (11, 1)), np.tile(end, (11, 1)), shares)
        assert np.allclose(geometry.to_matrices(found), expected, atol=1e-12)


def test_mean_rotation_ignores_the_sign_of_quaternions():
    rng = np.random.default_rng(0)
    centre = geometry.exp(np.array([0.3, -0.2, 2.0]))
    offsets = geometry.exp(np.vstack([noise := rng.normal(0, 0.01, (500, 3)), -noise]))
    quats = geometry.multiply(centre, offsets) * rng.choice([-1.0, 1.0], (1000, 1))
    found = geometry.mean_rotation(quats)
    error = geometry.log(geometry.multiply(geometry.inverse(centre), found))
    assert np.linalg.norm(error) < 1e-6
