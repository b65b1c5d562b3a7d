# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing import InputError
from bentwing.base import geometry
from bentwing.base.covariances import PoseCovariances, carried, positive_part, short_pairs

ORIGIN_NS = 1_600_000_000_123_456_789


@pytest.fixture
def covariances():
    roots = np.random.default_rng(3).normal(0.0, 1e-3, (4, 6, 6))
    return PoseCovariances(np.array([0.5, 1.0, 2.25, 4.0]), roots @ roots.swapaxes(1, 2))


def test_a_file_holds_the_upper_triangle_and_comes_back(covariances, tmp_path):
    path = tmp_path / "covariance.txt"
    covariances.write(path, ORIGIN_NS)
    lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    first = [float(word) for word in lines[0].split()]
    assert lines[0].split()[0] == "1600000000.623456789"
    assert len(first) == 22
    # Second row of the triangle begins behind the six of the first one.
    assert first[7] == pytest.approx(covariances.matrices[0, 1, 1], rel=1e-6)
    back = PoseCovariances.read(path, ORIGIN_NS)
    np.testing.assert_allclose(back.times, covariances.times, atol=1e-9)
    # Seven digits are written.
    largest = np.abs(covariances.matrices).max()
    np.testing.assert_allclose(back.matrices, covariances.matrices, atol=1e-6 * largest)


@pytest.mark.parametrize("line", ["1.0 2.0 3.0\n", "1.0" + 21 * " nan" + "\n"])
def test_another_file_is_refused_by_name(tmp_path, line):
    path = tmp_path / "covariance.txt"
    path.write_text(line)
    with pytest.raises(InputError, match=r"covariance\.txt"):
        PoseCovariances.read(path, 0)


def test_in_between_they_are_interpolated_and_beyond_they_stay(covariances):
    first, second, *_, last = covariances.matrices
    found = covariances.at([0.0, 0.75, 1.0, 9.0])
    np.testing.assert_allclose(found, [first, 0.5 * (first + second), second, last])


def test_parts_follow_each_other(covariances):
    empty = PoseCovariances(np.empty(0), np.empty((0, 6, 6)))
    assert PoseCovariances.joined([empty, covariances]) == covariances
    assert PoseCovariances.joined([empty]) is None


def test_what_is_fixed_to_a_pose_moves_with_its_turns():
    rng = np.random.default_rng(5)
    root = rng.normal(0.0, 1e-4, (6, 6))
    displacement = np.array([3.0, -2.0, 0.5])
    errors = rng.normal(size=(20_000, 6)) @ root.T
    turned = geometry.rotate(geometry.exp(errors[:, :3]), np.tile(displacement, (len(errors), 1)))
    moved = np.hstack([errors[:, :3], errors[:, 3:] + turned - displacement])
    expected = moved.T @ moved / len(moved)
    found = carried(root @ root.T, displacement)
    # 20,000 draws tell a variance to 1 %.
    np.testing.assert_allclose(found, expected, atol=0.05 * expected.max())


def test_doubt_about_the_vertical_lifts_what_is_far_away():
    still = PoseCovariances(np.array([0.0]), np.zeros((1, 6, 6)))
    (found,) = still.levelled(np.array([[10.0, 0.0, 0.0]]), np.array([0.0, 1e-3])).matrices
    std = np.sqrt(np.diag(found))
    np.testing.assert_allclose(std, [0.0, 1e-3, 0.0, 0.0, 0.0, 1e-2])


def test_pairs_are_ten_metres_of_path_apart_and_not_of_distance():
    times = np.arange(0.0, 12.0)
    there_and_back = np.minimum(2.0 * times, 24.0 - 2.0 * times)  # 2 m a second
    positions = np.stack([there_and_back, 0.0 * times, 0.0 * times], axis=1)
    pairs = short_pairs(times, positions)
    np.testing.assert_array_equal(pairs[:, 1] - pairs[:, 0], 5)
    assert pairs[0].tolist() == [0, 5]
    assert pairs[-1].tolist() == [6, 11]
    assert short_pairs(times[:5], positions[:5]).shape == (0, 2)


def test_variances_are_not_negative_and_others_keep_their_bits():
    sound = np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0])
    unsound = sound.copy()
    unsound[3, 3] = -0.5
    unsound[3, 4] = unsound[4, 3] = 0.1
    first, second = positive_part(np.array([sound, unsound]))
    assert np.array_equal(first, sound)
    assert np.linalg.eigvalsh(second).min() > -1e-12
    assert second[3, 3] >= 0.0
