# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bentwing.recording import Transform

angle = st.floats(-2 * np.pi, 2 * np.pi)
length = st.floats(-5, 5)


def axis_turn(axis: int, angle: float) -> np.ndarray:
    """The rotation matrix about one axis, as textbooks have it."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.eye(3)
    R[i, i] = R[j, j] = np.cos(angle)
    R[i, j], R[j, i] = -np.sin(angle), np.sin(angle)
    return R


@given(st.tuples(angle, angle, angle))
def test_angles_are_rz_ry_rx_as_in_urdf(rpy):
    roll, pitch, yaw = rpy
    expected = axis_turn(2, yaw) @ axis_turn(1, pitch) @ axis_turn(0, roll)
    given_ = Transform.model_validate({"rpy": rpy})
    np.testing.assert_allclose(given_.pose.R, expected, atol=1e-12)
    by_scipy = Rotation.from_euler("xyz", rpy).as_matrix()
    np.testing.assert_allclose(given_.pose.R, by_scipy, atol=1e-12)


@given(st.tuples(angle, angle, angle), st.tuples(length, length, length))
def test_a_matrix_is_the_transform_that_it_was_made_from(rpy, translation):
    first = Transform.model_validate({"rpy": rpy, "translation": translation})
    again = Transform.model_validate({"matrix": first.pose.matrix.tolist()})
    np.testing.assert_allclose(again.pose.matrix, first.pose.matrix, atol=1e-12)


@given(st.tuples(angle, angle, angle))
def test_degrees_are_the_same_angles(rpy):
    in_rad = Transform.model_validate({"rpy": rpy})
    in_deg = Transform.model_validate({"rpy_deg": (np.degrees(rpy) * (1 - 1e-15)).tolist()})
    np.testing.assert_allclose(in_deg.pose.R, in_rad.pose.R, atol=1e-12)
