# SPDX-License-Identifier: MIT OR Apache-2.0
from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bentwing.base.clock import NS_PER_S, to_ns
from bentwing.recording import Imu
from bentwing.recording.readings import ImuReading, VectorReading

axes = st.permutations("xyz").flatmap(
    lambda order: st.tuples(*[st.sampled_from([axis, f"-{axis}"]) for axis in order])
)
samples = arrays(np.float64, (5, 3), elements=st.floats(-100, 100))


def inverse(chosen):
    """The axes that undo the chosen ones."""
    back = [""] * 3
    for i, axis in enumerate(chosen):
        back["xyz".index(axis[-1])] = axis[:-1] + "xyz"[i]
    return tuple(back)


@given(chosen=axes, samples=samples)
def test_axes_and_their_inverse_leave_every_sample_as_it_was(chosen, samples):
    there, back = VectorReading.of(chosen, 1.0), VectorReading.of(inverse(chosen), 1.0)
    np.testing.assert_array_equal(back.vectors(there.vectors(samples)), samples)


@given(chosen=axes, samples=samples)
def test_axes_are_what_a_matrix_of_ones_and_minus_ones_makes_of_samples(chosen, samples):
    rows = [
        [(-1.0 if axis.startswith("-") else 1.0) * (axis[-1] == name) for name in "xyz"]
        for axis in chosen
    ]
    np.testing.assert_array_equal(
        VectorReading.of(chosen, 1.0).vectors(samples), samples @ np.array(rows).T
    )


@given(chosen=axes, alone=axes, samples=samples)
def test_the_gyro_has_its_own_axes_only_where_they_are_given(chosen, alone, samples):
    shared = ImuReading.of(Imu(axes=chosen))
    apart = ImuReading.of(Imu(axes=chosen, gyro_axes=alone))
    np.testing.assert_array_equal(shared.gyro.vectors(samples), shared.accel.vectors(samples))
    np.testing.assert_array_equal(apart.accel.vectors(samples), shared.accel.vectors(samples))
    np.testing.assert_array_equal(
        apart.gyro.vectors(samples), VectorReading.of(alone, 1.0).vectors(samples)
    )


@given(ns=st.integers(-4 * 10**9 * NS_PER_S, 4 * 10**9 * NS_PER_S))
def test_an_offset_is_applied_in_nanoseconds_to_what_its_number_holds(ns):
    seconds = ns / NS_PER_S
    # A float of today's epoch holds 240 ns, and nothing is lost beyond that.
    assert abs(to_ns(seconds) - ns) <= np.spacing(abs(seconds)) * NS_PER_S + 1
