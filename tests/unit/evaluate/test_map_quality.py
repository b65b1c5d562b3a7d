# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.evaluate.map import surface_error
from bentwing.evaluate.thickness import wall_thickness


def room(n=200_000, noise=0.012, seed=0):
    """The six sides of a box of 8 m, with noise across them."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-4, 4, (n, 3))
    side = rng.integers(0, 3, n)
    points[np.arange(n), side] = rng.choice([-4.3, 4.3], n) + rng.normal(0, noise, n)
    return points


def test_surface_error_finds_noise_and_bias_whatever_flies_about():
    rng = np.random.default_rng(0)
    distances = np.concatenate([rng.normal(0.002, 0.01, 50_000), rng.uniform(0.5, 3, 2_000)])
    found = surface_error(distances)
    # standard errors of MAD and median at 50,000 points: 0.5 % and 0.06 mm
    assert found.std == pytest.approx(0.01, rel=0.02)
    assert found.bias == pytest.approx(0.002, abs=2e-4)
    assert (found.n_points, found.n_excluded) == (52_000, 2_000)


def test_the_ratio_to_the_best_map_is_that_of_the_deviations():
    rng = np.random.default_rng(1)
    found = surface_error(rng.normal(0, 0.012, 50_000), best=rng.normal(0, 0.01, 50_000))
    assert found.best_ratio == pytest.approx(1.2, rel=0.03)


def test_distances_without_any_surface_are_refused():
    with pytest.raises(ValueError, match="none of 2"):
        surface_error(np.array([5.0, -9.0]))


def test_wall_thickness_is_the_noise_across_the_walls():
    found = wall_thickness(room())
    assert found.median == pytest.approx(0.012, rel=0.03)
    assert found.p25 < found.median < found.p75 < found.p90
    assert len(found.centres) == len(found.stds) > 100


def test_a_wall_mapped_twice_with_an_offset_is_thicker():
    twice = np.vstack([room(seed=0), room(seed=1) + 0.05])
    assert wall_thickness(twice).median == pytest.approx(np.hypot(0.012, 0.025), rel=0.1)


def test_clutter_in_front_of_walls_hardly_counts():
    clutter = np.random.default_rng(2).uniform(-4, 4, (20_000, 3))
    assert wall_thickness(np.vstack([room(), clutter])).median == pytest.approx(0.012, rel=0.1)


def test_the_draw_of_patches_is_repeatable(monkeypatch):
    monkeypatch.setattr("bentwing.evaluate.thickness.MOST_PATCHES", 50)
    a, b = wall_thickness(room(), seed=3), wall_thickness(room(), seed=3)
    assert np.array_equal(a.stds, b.stds)
    assert len(a.stds) <= 50


@pytest.mark.parametrize("n", [0, 50])
def test_a_map_without_flat_patches_is_refused(n):
    with pytest.raises(ValueError, match="no flat patch"):
        wall_thickness(np.random.default_rng(0).uniform(-1, 1, (n, 3)))


def test_the_visits_of_a_doubled_wall_are_measured_one_by_one():
    twice = np.vstack([room(seed=0), room(seed=1) + 0.05])
    found = wall_thickness(twice, np.repeat([0.0, 100.0], len(twice) // 2))
    assert found.median == pytest.approx(0.012, rel=0.05)
    assert 0.3 < found.is_later.mean() < 0.7


def partitions(n=400_000, noise=0.008, seed=3):
    """Both faces of thin walls, 0.1 m apart, which floor and cross walls meet, all seen at once."""
    rng = np.random.default_rng(seed)
    points, across = rng.uniform(0, 6, (n, 3)), rng.integers(0, 3, n)
    faces = np.floor(points[:, 0]) + rng.choice([0.05, 0.15], n)
    surface = np.stack([faces, np.floor(points[:, 1]), 0 * faces], axis=1)
    rows = np.arange(n)
    points[rows, across] = surface[rows, across] + rng.normal(0, noise, n)
    return points + np.array([0.37, 0.27, 0.08])


def test_corners_and_both_faces_of_a_partition_are_no_flat_surface():
    points = partitions()
    found = wall_thickness(points, np.zeros(len(points)))
    assert found.median == pytest.approx(0.008, rel=0.1)
    assert found.p90 < 0.012


def test_patches_are_as_small_as_the_points_allow():
    assert wall_thickness(room(1_000_000)).edge < wall_thickness(room(100_000)).edge


@pytest.mark.parametrize("noise", [0.005, 0.03, 0.08])
def test_thick_walls_are_not_cut_off_by_small_patches(noise):
    found = wall_thickness(room(600_000, noise), np.zeros(600_000))
    assert found.median == pytest.approx(noise, rel=0.07)
