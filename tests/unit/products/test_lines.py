# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.products import fit_lines

SIGMA = 0.01


def row(rng, first, last, n, sigma=SIGMA):
    """Points along a line with noise across and along it."""
    first, last = np.array(first, float), np.array(last, float)
    places = first + rng.uniform(size=(n, 1)) * (last - first)
    return places + rng.normal(0.0, sigma, (n, 2))


def ends_of(lines):
    """Rounded ends in order, whatever the direction of a line."""
    return sorted(sorted(tuple(end) for end in line) for line in lines.tolist())


def offsets(line, points):
    """Distances of points from the course of a line."""
    along = (line[1] - line[0]) / np.linalg.norm(line[1] - line[0])
    local = points - line[0]
    return np.abs(local[:, 0] * along[1] - local[:, 1] * along[0])


def test_a_rectangle_becomes_four_lines_that_share_their_corners():
    rng = np.random.default_rng(101)
    corners = np.array([(0, 0), (5, 1), (4.4, 4), (-0.6, 3)], float)
    points = np.concatenate([row(rng, corners[i], corners[(i + 1) % 4], 1500) for i in range(4)])
    lines = fit_lines(points)
    assert len(lines) == 4
    ends = lines.reshape(-1, 2)
    for corner in corners:
        near = ends[np.linalg.norm(ends - corner, axis=1) < 0.05]
        assert len(near) == 2
        assert np.array_equal(near[0], near[1])
        # Each of the two lines is known to 3 sigma / sqrt(n) at its middle, twice that at its ends.
        assert np.linalg.norm(near[0] - corner) < 3 * 2 * 2 * SIGMA / np.sqrt(1500) + 0.002


@pytest.mark.parametrize("apart", [0.08, 0.12, 0.3])
def test_two_faces_of_a_wall_stay_two_lines_at_their_distance(apart):
    rng = np.random.default_rng(102)
    points = np.concatenate(
        [row(rng, (0, 0), (6, 0), 2000), row(rng, (0, apart), (6, apart), 2000)]
    )
    lines = fit_lines(points)
    assert len(lines) == 2
    upper, lower = sorted(lines, key=lambda line: -line[:, 1].mean())
    assert upper[:, 1].mean() - lower[:, 1].mean() == pytest.approx(apart, abs=0.003)
    assert np.linalg.norm(lines[:, 1] - lines[:, 0], axis=1) == pytest.approx(6.0, abs=0.06)


def test_a_wall_with_a_door_is_two_lines_and_one_with_a_shadow_is_one():
    rng = np.random.default_rng(103)
    door = np.concatenate([row(rng, (0, 0), (2, 0), 800), row(rng, (2.8, 0), (5, 0), 900)])
    shadow = np.concatenate([row(rng, (0, 3), (2, 3), 800), row(rng, (2.15, 3), (5, 3), 1100)])
    lines = fit_lines(np.concatenate([door, shadow]))
    assert [round(float(np.linalg.norm(b - a)), 1) for a, b in lines] == [5.0, 2.2, 2.0]


def test_leaves_trunks_and_stray_points_are_no_walls():
    rng = np.random.default_rng(104)
    bush = rng.uniform(-1.0, 1.0, (3000, 2))
    turn = rng.uniform(0, np.pi, 800)
    trunk = [4.0, 0.0] + (0.2 + rng.normal(0, SIGMA, (800, 1))) * np.column_stack(
        [np.cos(turn), np.sin(turn)]
    )
    stray = rng.uniform(-10.0, 10.0, (300, 2))
    assert len(fit_lines(np.concatenate([bush, trunk, stray]))) == 0


def test_a_sparse_wall_far_away_is_found_as_well():
    rng = np.random.default_rng(105)
    lines = fit_lines(row(rng, (0, 20), (4, 20), 120))
    assert len(lines) == 1
    assert np.linalg.norm(lines[0, 1] - lines[0, 0]) == pytest.approx(4.0, abs=0.2)


def test_stray_points_beside_a_wall_do_not_turn_it():
    rng = np.random.default_rng(106)
    wall = row(rng, (0, 0), (5, 2), 2000)
    clutter = np.column_stack([rng.uniform(0, 5, 400), rng.uniform(0.6, 3, 400)])
    (line,) = fit_lines(np.concatenate([wall, clutter]))
    assert offsets(line, np.array([(0.0, 0.0), (5.0, 2.0)])).max() < 0.004


def test_weights_stand_for_points():
    rng = np.random.default_rng(107)
    points = row(rng, (0, 0), (3, 1), 600)
    weights = rng.integers(1, 4, 600)
    weighted = fit_lines(points, weights)
    repeated = fit_lines(np.repeat(points, weights, axis=0))
    assert np.allclose(ends_of(weighted), ends_of(repeated), atol=0.002)


@pytest.mark.parametrize("points", [np.empty((0, 2)), np.zeros((1, 2)), np.zeros((500, 2))])
def test_what_has_no_length_has_no_lines(points):
    assert fit_lines(points).shape == (0, 2, 2)


def test_points_that_are_no_numbers_are_refused():
    with pytest.raises(ValueError, match="row 1 is not finite"):
        fit_lines([(0.0, 0.0), (np.nan, 1.0)])
