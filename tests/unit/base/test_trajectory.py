# SPDX-License-Identifier: MIT OR Apache-2.0
import copy
import pickle

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory, read_tum

ORIGIN_NS = 1_700_000_000_123_456_789


def screw(n=200, rate=4.0):
    """A steady turn about z on a straight way: linear p and slerped R are exact for it."""
    times = 0.01 * np.arange(n)
    turns = np.stack([0 * times, 0 * times, rate * times], axis=1)
    return Trajectory(times, np.outer(times, [1.0, 2.0, 0.5]), geometry.exp(turns))


def test_the_poses_within_spans_are_kept():
    times = 0.1 * np.arange(11)
    whole = Trajectory(times, np.zeros((11, 3)), np.tile([0.0, 0.0, 0.0, 1.0], (11, 1)))
    part = whole.within([(0.0, 0.25), (0.75, 2.0)])
    assert part.times == pytest.approx([0.0, 0.1, 0.2, 0.8, 0.9, 1.0])
    assert whole.within([]) is whole


def test_interpolation_is_exact_for_a_steady_screw_motion():
    times = np.random.default_rng(0).uniform(0, 1.99, 500)
    positions, quats = screw().interpolate(times)
    assert np.allclose(positions, np.outer(times, [1.0, 2.0, 0.5]), atol=1e-14)
    turned = geometry.multiply(geometry.inverse(screw().quats_xyzw[:1]), quats)
    expected = np.mod(4.0 * times + np.pi, 2 * np.pi) - np.pi
    assert np.allclose(geometry.log(turned)[:, 2], expected, atol=1e-12)


def test_samples_themselves_are_returned_at_their_times():
    trajectory = screw()
    positions, quats = trajectory.interpolate(trajectory.times)
    assert np.allclose(positions, trajectory.positions, atol=1e-15)
    assert np.allclose(np.abs(np.sum(quats * trajectory.quats_xyzw, axis=1)), 1.0, atol=1e-12)


def test_times_outside_the_trajectory_are_refused_and_named():
    with pytest.raises(ValueError, match=r"2\.500000 s in row 1"):
        screw().interpolate(np.array([0.0, 2.5]))
    assert screw().covers(np.array([-0.1, 0.0, 1.99, 2.0])).tolist() == [False, True, True, False]


def test_written_stamps_are_exact_to_the_nanosecond(tmp_path):
    times = np.array([0.0, 0.01, 0.020000001, 86_400.000000003])
    trajectory = Trajectory(times, np.zeros((4, 3)), np.tile([0.0, 0, 0, 1], (4, 1)))
    trajectory.write_tum(tmp_path / "t.txt", ORIGIN_NS)
    stamps = [line.split()[0] for line in (tmp_path / "t.txt").read_text().splitlines()]
    assert stamps == [
        "1700000000.123456789",
        "1700000000.133456789",
        "1700000000.143456790",
        "1700086400.123456792",
    ]


def test_a_trajectory_survives_writing_and_reading(tmp_path):
    trajectory = screw()
    trajectory.write_tum(tmp_path / "t.txt", ORIGIN_NS)
    back, origin_ns = read_tum(tmp_path / "t.txt")
    assert origin_ns == ORIGIN_NS
    assert np.array_equal(np.rint(back.times * 1e9), np.rint(trajectory.times * 1e9))
    assert np.allclose(back.positions, trajectory.positions, atol=5.1e-7)
    shifted, _ = read_tum(tmp_path / "t.txt", ORIGIN_NS - 1_000_000_000)
    assert shifted.times[0] == 1.0


def test_stamps_in_scientific_notation_and_comments_are_read(tmp_path):
    (tmp_path / "t.txt").write_text(
        "# made elsewhere\n\n1.305031102175300121e+09 1 2 3 0 0 0 2\n1305031102.2753 1 2 3 0 0 0 1\n"
    )
    trajectory, origin_ns = read_tum(tmp_path / "t.txt")
    assert origin_ns == 1_305_031_102_175_300_121
    assert trajectory.quats_xyzw[0].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "holds no pose"),
        ("1 2 3\n", "line 1"),
        ("1 0 0 0 0 0 0 1\nx 0 0 0 0 0 0 1\n", "line 2"),
        ("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "pose 2"),
        ("1 0 0 0 0 0 0 0\n", "length zero"),
        ("1 nan 0 0 0 0 0 1\n", "not finite"),
        ("inf 0 0 0 0 0 0 1\n", "line 1"),
    ],
)
def test_a_damaged_trajectory_is_refused_with_its_place(tmp_path, text, message):
    (tmp_path / "t.txt").write_text(text)
    with pytest.raises(InputError, match=message):
        read_tum(tmp_path / "t.txt")


def test_a_missing_trajectory_is_an_input_error(tmp_path):
    with pytest.raises(InputError, match="not readable"):
        read_tum(tmp_path / "none.txt")


def test_it_is_as_long_as_it_has_poses():
    assert len(screw(7)) == 7
    assert len(screw(7)[:0]) == 0


@pytest.mark.parametrize(
    ("chosen", "rows"),
    [
        (slice(2, 5), [2, 3, 4]),
        (slice(None, None, 4), [0, 4, 8]),
        (np.arange(9) > 6, [7, 8]),
        ([1, 3], [1, 3]),
        (np.array([0, 8]), [0, 8]),
        (4, [4]),
        (-1, [8]),
        (np.int64(2), [2]),
    ],
)
def test_whatever_selects_rows_gives_a_trajectory(chosen, rows):
    whole = screw(9)
    part = whole[chosen]
    assert isinstance(part, Trajectory)
    assert np.array_equal(part.times, whole.times[rows])
    assert np.array_equal(part.positions, whole.positions[rows])
    assert np.array_equal(part.quats_xyzw, whole.quats_xyzw[rows])


def test_it_can_be_walked_pose_by_pose_and_no_further():
    assert [pose.times[0] for pose in screw(3)] == [0.0, 0.01, 0.02]
    with pytest.raises(IndexError):
        screw(3)[3]


def test_an_order_backwards_in_time_is_refused():
    with pytest.raises(ValueError, match=r"times: must increase, but row 1 is 0\.01 s after 0\.02"):
        screw(3)[::-1]


def test_matrices_and_back_are_the_same_poses():
    trajectory = screw()
    T = trajectory.T_map_imu
    assert T.shape == (200, 4, 4)
    point = np.array([1.0, -2.0, 3.0])
    placed = trajectory.positions + geometry.rotate(trajectory.quats_xyzw, point)
    assert np.allclose((T @ [*point, 1.0])[:, :3], placed, atol=1e-14)
    again = Trajectory.from_matrices(trajectory.times, T)
    assert np.allclose(again.T_map_imu, T, atol=1e-14)


@pytest.mark.parametrize(
    "wrong",
    [
        np.diag([2.0, 2.0, 2.0, 1.0]),
        np.diag([1.0, 1.0, -1.0, 1.0]),
        np.block([[np.eye(3), np.zeros((3, 1))], [np.array([[1.0, 0.0, 0.0, 1.0]])]]),
    ],
    ids=["scaled", "mirrored", "transposed"],
)
def test_matrices_that_are_no_rigid_transforms_are_refused_and_named(wrong):
    with pytest.raises(ValueError, match="T_map_imu: matrix 1 is not a rotation"):
        Trajectory.from_matrices([0.0, 1.0], [np.eye(4), wrong])


def test_equal_means_equal_poses_and_nothing_else_is_equal():
    assert screw() == screw()
    assert screw() != screw(rate=4.1)
    assert screw(5) != screw(6)
    assert screw() != 3
    assert (screw() == np.zeros(3)) is False
    assert (np.zeros(3) == screw()) is False


def test_its_representation_is_short():
    assert repr(screw()) == "Trajectory(200 poses, 0.000 to 1.990 s)"
    assert repr(screw(1)) == "Trajectory(1 pose, 0.000 to 0.000 s)"
    assert repr(screw()[:0]) == "Trajectory(no poses)"


def test_copies_and_pickles_are_equal_and_independent():
    for again in (copy.deepcopy(screw()), pickle.loads(pickle.dumps(screw()))):
        assert again == screw()
        assert again.times is not screw().times


def test_numbers_of_any_type_become_float64_and_float64_is_not_copied():
    given = screw(2)
    single = Trajectory(
        given.times.astype(np.float32), given.positions.tolist(), given.quats_xyzw[::1]
    )
    assert {single.times.dtype, single.positions.dtype} == {np.dtype(np.float64)}
    assert Trajectory(given.times, given.positions, given.quats_xyzw).positions is given.positions


@pytest.mark.parametrize(
    ("changes", "error", "sentence"),
    [
        ({"times": [0.0, np.nan]}, ValueError, "times: row 1 is not finite: nan"),
        ({"positions": [[0, 0, 0], [0, np.inf, 0]]}, ValueError, "positions: row 1 is not finite"),
        ({"quats_xyzw": np.full((2, 4), np.nan)}, ValueError, "quats_xyzw: row 0 is not finite"),
        ({"times": [1.0, 1.0]}, ValueError, "times: must increase, but row 1 is 1 s after 1 s"),
        ({"positions": np.zeros((3, 3))}, ValueError, r"positions: expected shape \(2, 3\), got"),
        ({"times": [[0.0, 1.0]]}, ValueError, r"times: expected shape \(N,\), got \(1, 2\)"),
        ({"times": "now"}, TypeError, "times: expected numbers"),
        (
            {"positions": [[0, 0, 0], [0, 0]]},
            TypeError,
            r"positions: expected numbers of shape \(2, 3",
        ),
    ],
)
def test_arrays_that_do_not_fit_are_named(changes, error, sentence):
    fitting = {"times": [0, 1], "positions": np.zeros((2, 3)), "quats_xyzw": [[0, 0, 0, 1]] * 2}
    with pytest.raises(error, match=sentence):
        Trajectory(**{**fitting, **changes})
