# SPDX-License-Identifier: MIT OR Apache-2.0
import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.map.chunk import MapChunk
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin


def chunks(points, n_chunks=10):
    times = np.arange(len(points), dtype=np.float64)
    for part in np.array_split(np.arange(len(points)), n_chunks):
        yield MapChunk(points[part], times[part], np.zeros(len(part), np.float32))


def test_the_first_point_of_every_voxel_is_kept():
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    counts = {}
    kept = np.concatenate([c.times for c in thin(chunks(points), 0.1, counts)]).astype(int)
    _, first = np.unique(np.floor(points / 0.1), axis=0, return_index=True)
    assert kept.tolist() == sorted(first.tolist())
    assert counts["map.thinned"] == 5000 - len(kept)


def test_spacing_zero_keeps_all_points():
    points = np.zeros((100, 3))
    assert sum(map(len, thin(chunks(points), 0.0))) == 100


@pytest.mark.parametrize("spacing", [-0.1, np.nan, np.inf])
def test_an_impossible_spacing_is_refused_before_the_work(spacing):
    with pytest.raises(UsageError, match="map spacing"):
        thin([], spacing)


def test_the_sample_is_even_and_bounded():
    points = np.random.default_rng(0).uniform(-1, 1, (12_345, 3))
    sample = MapSample(limit=1000)
    passed = sum(len(chunk) for chunk in sample.watch(chunks(points, 37)))
    assert passed == 12_345
    assert 500 <= len(sample.points) <= 1000
    assert len(np.unique(np.diff(sample.times))) == 1
    assert np.array_equal(sample.points, points[sample.times.astype(int)])
