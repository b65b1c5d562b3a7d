# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.evaluate import spacing as spacing_module
from bentwing.evaluate.clouds import Cloud
from bentwing.evaluate.entropy import map_entropy
from bentwing.evaluate.revisits import revisit_consistency
from bentwing.evaluate.spacing import point_spacing
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map


def cloud_of(points, tmp_path):
    with open_map(tmp_path / "map.ply", "ply", 0) as writer:
        writer.write(MapChunk(points, np.zeros(len(points)), np.zeros(len(points), np.float32)))
    return Cloud(tmp_path / "map.ply")


def wall(n, *, at=0.0, noise=0.004, seed=0):
    rng = np.random.default_rng(seed)
    return np.column_stack([at + rng.normal(0, noise, n), rng.uniform(0, 6, (n, 2))])


def grid(step, n=100):
    at = step * np.arange(n)
    return np.stack(np.meshgrid(at, at, [0.0]), axis=-1).reshape(-1, 3)


def test_spacing_of_a_grid_is_its_step(tmp_path):
    found = point_spacing(cloud_of(grid(0.01), tmp_path))
    assert (found.median, found.p5, found.p95) == pytest.approx((0.01, 0.01, 0.01))
    assert found.n_points == 10_000


def test_spacing_of_random_points_on_a_plane_is_that_of_a_poisson_process(tmp_path):
    points = np.random.default_rng(0).uniform(0, 2, (40_000, 3)) * [1, 1, 0]
    # P(distance > r) = exp(-density pi r²)
    expected = np.sqrt(np.log(2) / (np.pi * 10_000))
    assert point_spacing(cloud_of(points, tmp_path)).median == pytest.approx(expected, rel=0.02)


def test_spacing_of_some_columns_is_that_of_all(tmp_path, monkeypatch):
    points = np.random.default_rng(1).uniform(0, 30, (300_000, 3)) * [1, 1, 0]
    cloud = cloud_of(points, tmp_path)
    whole = point_spacing(cloud)
    monkeypatch.setattr(spacing_module, "_MOST", 60_000)
    part = point_spacing(cloud)
    assert part.n_points < 80_000
    assert part.median == pytest.approx(whole.median, rel=0.03)


def test_a_single_point_has_no_spacing(tmp_path):
    assert point_spacing(cloud_of(np.zeros((1, 3)), tmp_path)) is None


def test_entropy_of_a_gaussian_cloud_is_its_formula():
    points = np.random.default_rng(0).normal(0, 0.02, (1_200, 3))
    expected = 0.5 * 3 * np.log(2 * np.pi * np.e * 0.02**2)
    assert map_entropy(points).mean == pytest.approx(expected, abs=0.05)


def test_a_map_with_thicker_walls_has_more_entropy():
    crisp, blurred = (map_entropy(wall(8_000, noise=noise)).mean for noise in (0.005, 0.02))
    # of three principal deviations one is four times as large
    assert blurred - crisp == pytest.approx(np.log(4), rel=0.05)


def test_a_thin_cloud_has_no_entropy():
    assert map_entropy(np.random.default_rng(0).uniform(0, 99, (100, 3))) is None
    assert map_entropy(np.zeros((3, 3))) is None


def test_a_wall_seen_again_with_an_offset_shows_it():
    n = 40_000
    rng = np.random.default_rng(0)
    points = np.vstack([wall(n, at=0.11, seed=1), wall(n, at=0.13, seed=2)])
    times = np.concatenate([rng.uniform(0, 5, n), rng.uniform(60, 65, n)])
    found = revisit_consistency(points, times)
    assert found.median == pytest.approx(0.02, abs=1e-3)
    assert np.median(found.intervals) == pytest.approx(60, abs=1)
    assert found.n_patches > 100


def test_a_wall_seen_once_is_no_revisit():
    times = np.linspace(0, 60, 40_000)
    assert revisit_consistency(wall(40_000, at=0.1), times) is None


def test_two_faces_of_a_thin_wall_are_not_taken_for_one():
    n = 40_000
    rng = np.random.default_rng(0)
    points = np.vstack([wall(n, at=0.01), wall(n, at=0.45)])
    times = np.concatenate([rng.uniform(0, 5, n), rng.uniform(60, 65, n)])
    assert revisit_consistency(points, times) is None
