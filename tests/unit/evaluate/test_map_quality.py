# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.evaluate.map import surface_error, wall_thickness


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
    monkeypatch.setattr("bentwing.evaluate.map.MOST_PATCHES", 50)
    a, b = wall_thickness(room(), seed=3), wall_thickness(room(), seed=3)
    assert np.array_equal(a.stds, b.stds)
    assert len(a.stds) <= 50


@pytest.mark.parametrize("n", [0, 50])
def test_a_map_without_flat_patches_is_refused(n):
    with pytest.raises(ValueError, match="no flat patch"):
        wall_thickness(np.random.default_rng(0).uniform(-1, 1, (n, 3)))
