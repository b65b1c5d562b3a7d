# SPDX-License-Identifier: MIT OR Apache-2.0
"""The boundary of arrays: every array argument of the core, against everything that can be wrong."""

from __future__ import annotations

import re
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import _core
from bentwing.odometry.continuous.slow_states import N_STATES

N = 6


@dataclass(frozen=True)
class Argument:
    """One array argument of one call of the core.

    Attributes
    ----------
    call : by its name in `valid`
    name : of the argument, as the errors must say it
    width : number of columns; None of a vector
    time : whether it must not decrease
    """

    call: str
    name: str
    width: int | None
    integer: bool = False
    time: bool = False

    def __str__(self):
        return f"{self.call}-{self.name}"


def quats(n=N):
    return np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))


def xyz(n=N):
    return np.random.default_rng(0).normal(size=(n, 3))


def valid():
    """A valid array for every argument, by call."""
    times = np.arange(N) * 0.01
    return {
        "scene": {"vertices": xyz(), "triangles": np.array([[0, 1, 2], [3, 4, 5]], np.uint32)},
        "cast": {"origins": xyz(), "directions": xyz()},
        "distance": {"points": xyz()},
        "samples": {"positions": xyz(), "quats_xyzw": quats()},
        "imu": {"stamps": times, "gyro": xyz(), "accel": xyz()},
        "place": {"points": xyz(), "stamps": times, "angles": times.copy()},
        "extract_surfels": {"points": xyz(), "stamps": times, "angles": times.copy()},
        "register_window": {"information": 1e6 * np.eye(N_STATES)},
    }


ARGUMENTS = [
    Argument("scene", "vertices", 3),
    Argument("scene", "triangles", 3, integer=True),
    Argument("cast", "origins", 3),
    Argument("cast", "directions", 3),
    Argument("distance", "points", 3),
    Argument("samples", "positions", 3),
    Argument("samples", "quats_xyzw", 4),
    Argument("imu", "stamps", None, time=True),
    Argument("imu", "gyro", 3),
    Argument("imu", "accel", 3),
    *[
        argument
        for call in ("place", "extract_surfels")
        for argument in (
            Argument(call, "points", 3),
            Argument(call, "stamps", None, time=True),
            Argument(call, "angles", None),
        )
    ],
    Argument("register_window", "information", N_STATES),
]
FLOATS = [a for a in ARGUMENTS if not a.integer]


@pytest.fixture(scope="module")
def calls(room, samples, states, extract, register):
    """Each call of the core by name, with arrays as keyword arguments."""
    return {
        "scene": lambda **arrays: _core.Scene(**arrays),
        "cast": lambda **arrays: room.cast(**arrays, max_range=5.0),
        "distance": lambda **arrays: room.distance(**arrays),
        "samples": lambda **arrays: _core.Samples(0.0, 0.01, **arrays),
        "imu": lambda **arrays: _core.Imu(**arrays),
        "place": lambda **arrays: samples.place(**arrays, globals=states()),
        "extract_surfels": lambda **arrays: extract(**arrays),
        "register_window": lambda **arrays: register(surfels=[], **arrays),
    }


@pytest.fixture
def call(calls):
    """Call with valid arrays but for one."""

    def with_(argument, array):
        return calls[argument.call](**{**valid()[argument.call], argument.name: array})

    return with_


def content(result):
    """The arrays and numbers by which two results of one call are told apart."""
    if isinstance(result, np.ndarray):
        return [result]
    if isinstance(result, tuple):
        return [array for part in result for array in content(part)]
    if isinstance(result, _core.Scene):
        return content(result.distance(xyz(3)))
    if isinstance(result, _core.Samples):
        return [result.positions, result.quats_xyzw]
    if isinstance(result, _core.Surfels):
        return [result.stamps, result.means, result.normals]
    if isinstance(result, _core.Registration):
        return [*content(result.samples), result.covariance]
    return [np.array(len(result))]


def array_of(argument):
    return valid()[argument.call][argument.name]


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_read_only_arrays_give_the_same_result(call, argument):
    array, expected = array_of(argument), content(call(argument, array_of(argument)))
    array.flags.writeable = False
    assert all(map(np.array_equal, content(call(argument, array)), expected))


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_arrays_are_not_changed(call, argument):
    array = array_of(argument)
    call(argument, array)
    assert np.array_equal(array, array_of(argument))


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
@pytest.mark.parametrize("dtype", [np.float32, np.int64, np.complex128, object])
def test_other_element_types_are_refused(call, argument, dtype):
    with pytest.raises(TypeError):
        call(argument, array_of(argument).astype(dtype))


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_lists_are_refused(call, argument):
    with pytest.raises(TypeError):
        call(argument, array_of(argument).tolist())


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_another_byte_order_is_refused(call, argument):
    array = array_of(argument)
    with pytest.raises(TypeError):
        call(argument, array.astype(array.dtype.newbyteorder()))


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_another_number_of_dimensions_is_refused(call, argument):
    with pytest.raises(TypeError):
        call(argument, array_of(argument)[None])
    with pytest.raises(TypeError):
        call(argument, array_of(argument)[0])


@pytest.mark.parametrize("argument", [a for a in ARGUMENTS if a.width], ids=str)
def test_another_width_is_refused_with_both_shapes(call, argument):
    array = np.ascontiguousarray(array_of(argument)[:, :-1])
    rows, width = array.shape
    found = rf"\({rows}, {width}\)"
    with pytest.raises(ValueError, match=rf"^{argument.name}: .*, got {found}"):
        call(argument, array)


@pytest.mark.parametrize("argument", ARGUMENTS, ids=str)
def test_strided_arrays_are_refused_by_name(call, argument):
    array = np.repeat(array_of(argument), 2, axis=0)[::2]
    with pytest.raises(ValueError, match=rf"^{argument.name}: expected a .*contiguous array"):
        call(argument, array)


@pytest.mark.parametrize("argument", [a for a in ARGUMENTS if a.width], ids=str)
def test_fortran_order_is_refused_by_name(call, argument):
    with pytest.raises(ValueError, match=rf"^{argument.name}: expected a C-contiguous array"):
        call(argument, np.asfortranarray(array_of(argument)))


@pytest.mark.parametrize("argument", FLOATS, ids=str)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_refused_with_its_row(call, argument, value):
    array = array_of(argument)
    array.reshape(len(array), -1)[4, -1] = value
    place = "row 4" if argument.width else "element 4"
    with pytest.raises(ValueError, match=rf"^{argument.name}: {place} is not finite"):
        call(argument, array)


@pytest.mark.parametrize("argument", [a for a in ARGUMENTS if a.time], ids=str)
def test_decreasing_times_are_refused_with_the_element(call, argument):
    array = array_of(argument)
    array[3] = -1.0
    with pytest.raises(ValueError, match=rf"^{argument.name}: must not decrease, but element 3"):
        call(argument, array)


@pytest.mark.parametrize("argument", [a for a in ARGUMENTS if a.time], ids=str)
def test_equal_times_give_finite_results(call, argument):
    assert all(np.isfinite(array).all() for array in content(call(argument, np.full(N, 0.02))))


@pytest.mark.parametrize(
    "argument",
    [a for a in ARGUMENTS if a.call not in {"scene", "distance"}],
    ids=str,
)
def test_another_number_of_rows_than_the_others_is_refused(call, argument):
    with pytest.raises(ValueError, match=r"\d"):
        call(argument, np.ascontiguousarray(array_of(argument)[:-1]))


@pytest.mark.parametrize("name", ["cast", "distance", "imu", "place", "extract_surfels"])
def test_empty_arrays_give_empty_results(calls, name):
    result = calls[name](**{key: array[:0] for key, array in valid()[name].items()})
    assert not any(array.size and array.any() for array in content(result))


@pytest.mark.parametrize("n", [0, 1])
def test_samples_need_two_poses(n):
    with pytest.raises(ValueError, match=f"at least 2 samples, got {n}"):
        _core.Samples(0.0, 0.01, xyz(n), quats(n))


@pytest.mark.parametrize("norm", [0.0, 0.99, 1.01])
def test_quaternions_must_have_norm_one(norm):
    with pytest.raises(ValueError, match=r"^quats_xyzw: expected a unit quaternion, got norm"):
        _core.Samples(0.0, 0.01, xyz(), norm * quats())


def test_quaternions_rounded_to_four_digits_are_accepted():
    rounded = np.round(np.tile([0.1826, 0.3651, 0.5477, 0.7303], (N, 1)), 4)
    kept = _core.Samples(0.0, 0.01, xyz(), rounded).quats_xyzw
    assert np.allclose(np.linalg.norm(kept, axis=1), 1.0, atol=1e-15)


def test_results_own_their_memory(samples):
    positions = samples.positions
    positions[:] = 0.0
    assert samples.positions.any()


@pytest.mark.parametrize("sigma", [np.nan, -0.01, np.inf])
def test_the_noise_of_ranges_must_be_a_length(extract, sigma):
    with pytest.raises(ValueError, match="range_sigma"):
        extract(range_sigma=sigma)


def test_no_argument_is_forgotten():
    """Every array in the signatures of the core is in the table above."""
    documented = SimpleNamespace(
        scene=_core.Scene, imu=_core.Imu, samples=_core.Samples, place=_core.Samples.place,
        extract_surfels=_core.extract_surfels,
    )  # fmt: skip
    # `responses` have three axes, see test_pickles.py, and `at_limit` is of bool, see test_imu_limits.py.
    others = {
        "responses",
        "at_limit",
        "start",
        "dt",
        "samples",
        "globals",
        "settings",
        "range_sigma",
        "threads",
        "self",
    }
    for call, function in vars(documented).items():
        names = set(re.findall(r"[\w$]+", function.__text_signature__)) - {"None", "0"} - others
        assert names - {"$self"} == {a.name for a in ARGUMENTS if a.call == call}
