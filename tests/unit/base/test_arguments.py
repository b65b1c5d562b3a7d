# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.arguments import finite_array, in_order, instance, thread_count


def test_arrays_that_fit_are_not_copied():
    points = np.zeros((4, 3))
    assert finite_array("points", points, None, 3) is points


@pytest.mark.parametrize(
    "value", [[[1, 2, 3]], np.ones((3, 1), np.float32).T, np.ones((2, 3))[::2], ((True, 0, 2.5),)]
)
def test_numbers_of_any_form_become_rows_of_float64(value):
    array = finite_array("points", value, None, 3)
    assert array.dtype == np.float64
    assert array.flags.c_contiguous
    assert np.array_equal(array, np.asarray(value, float))


def test_an_empty_array_of_the_right_shape_is_taken():
    assert finite_array("points", np.empty((0, 3)), None, 3).shape == (0, 3)
    in_order("times", np.empty(0), strictly=True)


@pytest.mark.parametrize(
    ("value", "error", "sentence"),
    [
        (None, ValueError, r"points: expected shape \(N, 3\), got \(\)"),
        ([["a", "b", "c"]], TypeError, "points: expected numbers"),
        (3.0, ValueError, r"points: expected shape \(N, 3\), got \(\)"),
        (np.zeros((3, 2)), ValueError, r"points: expected shape \(N, 3\), got \(3, 2\)"),
        (
            [[0, 0, 0], [0, np.nan, 1]],
            ValueError,
            r"points: row 1 is not finite: \[0.0, nan, 1.0\]",
        ),
    ],
)
def test_what_does_not_fit_is_named(value, error, sentence):
    with pytest.raises(error, match=sentence):
        finite_array("points", value, None, 3)


def test_times_may_repeat_unless_they_have_to_increase():
    in_order("times", np.array([0.0, 1.0, 1.0]))
    with pytest.raises(ValueError, match="times: must increase, but row 2 is 1 s after 1 s"):
        in_order("times", np.array([0.0, 1.0, 1.0]), strictly=True)
    with pytest.raises(ValueError, match="times: must not decrease, but row 1 is 0 s after 1 s"):
        in_order("times", np.array([1.0, 0.0]))


def test_a_wrong_type_is_refused_with_what_to_do():
    with pytest.raises(TypeError, match="count: expected an int, got str; give a number"):
        instance("count", "3", int, "give a number")


def test_threads_are_a_number_or_all_cores():
    assert thread_count(None) == 0
    assert thread_count(2) == 2
    with pytest.raises(ValueError, match="threads: expected a number from 1 to 1024, or None"):
        thread_count(-1)
