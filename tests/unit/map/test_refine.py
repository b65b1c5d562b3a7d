# SPDX-License-Identifier: MIT OR Apache-2.0
import functools
from dataclasses import replace

import numpy as np
import pytest

from bentwing import _core
from bentwing.map import refine as refining
from bentwing.map.chunk import MapChunk
from bentwing.map.refine import refine
from bentwing.map.sample import MapSample
from bentwing.map.thin import thin

NOISE, DURATION, CHUNK = 0.01, 30.0, 10_000


@functools.cache
def recording(n=60_000, seed=1):
    """A floor of 8 m by 4 m, seen from above in any order."""
    rng = np.random.default_rng(seed)
    true = np.c_[rng.uniform(0, 8, n), rng.uniform(-2, 2, n), np.zeros(n)]
    origins = np.c_[true[:, 0] + rng.uniform(-1, 1, n), rng.uniform(-2, 2, n), rng.uniform(2, 4, n)]
    gaps = true - origins
    ranges = np.linalg.norm(gaps, axis=1)
    beams = gaps / ranges[:, None]
    ranges = ranges + NOISE * rng.normal(size=n)
    points = origins + beams * ranges[:, None]
    times = np.sort(rng.uniform(0, DURATION, n))
    return tuple(
        MapChunk(
            points[part],
            times[part],
            ranges[part].astype(np.float32),
            intensity=part.astype(np.float32),
            beams=beams[part].astype(np.float32),
        )
        for part in np.split(np.arange(n), n // CHUNK)
    )


def refined(tmp_path, chunks=None, **options):
    return list(refine(iter(recording() if chunks is None else chunks), tmp_path, **options))


def heights(chunks):
    return np.concatenate([chunk.points[:, 2] for chunk in chunks])


def test_points_come_to_the_floor_along_their_beams_and_in_their_order(tmp_path):
    counts, record = {}, {}
    found = refined(tmp_path, counts=counts, record=record)
    assert [len(chunk) for chunk in found] == [CHUNK] * 6
    assert heights(found).std() < 0.35 * heights(recording()).std()
    for before, after in zip(recording(), found, strict=True):
        assert np.array_equal(before.intensity, after.intensity)
        assert np.array_equal(before.ranges, after.ranges)
        moved = after.points - before.points
        assert np.abs(moved - before.beams * after.shift[:, None].astype(float)).max() < 1e-12
        assert np.abs(after.measured - before.points).max() < 1e-12
    shifts = np.concatenate([chunk.shift for chunk in found])
    assert counts == {"map.refined": np.count_nonzero(shifts)}
    assert record["moved"] == counts["map.refined"] / shifts.size > 0.95
    assert record["move"] == pytest.approx(np.median(np.abs(shifts[shifts != 0])), abs=1e-4)
    assert record["sigma"] < 0.5 * record["sigma_before"]
    assert record["sigma_before"] == pytest.approx(NOISE, rel=0.15)
    assert list(tmp_path.iterdir()) == []


def test_a_map_in_slabs_is_as_good_as_one_in_one_piece(tmp_path, monkeypatch):
    whole = refined(tmp_path)
    monkeypatch.setattr(refining, "MOST_POINTS", 40_000)
    slabs = refined(tmp_path)
    assert heights(slabs).std() == pytest.approx(heights(whole).std(), rel=0.1)
    # Nothing of the order is lost, and where slabs meet there is no edge.
    for chunk, other in zip(whole, slabs, strict=True):
        assert np.array_equal(chunk.intensity, other.intensity)
        assert np.abs(chunk.points - other.points).max() < 3 * NOISE
    seam = np.abs(np.concatenate([c.points[:, 0] for c in slabs]) % 1.0 - 0.5) > 0.4
    assert heights(slabs)[seam].std() < 1.2 * heights(slabs)[~seam].std()


def test_one_metre_that_holds_too_many_points_is_told_by_some_of_them(tmp_path, monkeypatch):
    monkeypatch.setattr(refining, "MOST_POINTS", 4_000)
    found = refined(tmp_path)
    assert heights(found).std() < 0.5 * heights(recording()).std()


def test_the_number_of_threads_changes_no_byte(tmp_path):
    one, two = refined(tmp_path, threads=1), refined(tmp_path, threads=2)
    for a, b in zip(one, two, strict=True):
        assert a.points.tobytes() == b.points.tobytes()
        assert a.sigma.tobytes() == b.sigma.tobytes()


@pytest.mark.parametrize("far", [26_214.4, -40_000.0])
def test_a_map_far_from_its_origin_is_refined_as_well(tmp_path, far):
    # Places in the map are whole numbers that begin anew every 52.4 km.
    chunks = [replace(c, points=c.points + np.array([far, -far, 0.0])) for c in recording()]
    found = refined(tmp_path, chunks)
    assert heights(found).std() < 0.35 * heights(recording()).std()


def test_few_points_stay_where_they_are(tmp_path):
    few = recording()[0].where(slice(0, 50))
    record = {}
    (found,) = refined(tmp_path, [few], record=record)
    assert np.array_equal(found.points, few.points)
    assert np.isnan(found.sigma).all()
    assert record == {"moved": 0.0, "move": None, "sigma_before": None, "sigma": None}


def test_a_map_without_points_has_nothing_to_refine(tmp_path):
    record = {}
    assert refined(tmp_path, [], record=record) == []
    assert record["moved"] is None


def test_the_sample_keeps_the_points_as_measured(tmp_path):
    sample = MapSample()
    list(sample.watch(thin(refine(iter(recording()), tmp_path), 0.0)))
    raw = np.concatenate([chunk.points for chunk in recording()])
    assert np.abs(sample.points - raw).max() < 1e-12


def test_beams_are_needed(tmp_path):
    chunk = MapChunk(np.zeros((3, 3)), np.arange(3.0), np.ones(3, np.float32))
    with pytest.raises(ValueError, match=r"chunk\.beams: expected the direction of every beam"):
        refined(tmp_path, [chunk])


def test_a_sample_is_used_once():
    chunk, lengths = recording()[0], {"edge": 0.05, "pass_length": 0.5}
    beams = {"beams": chunk.beams, "ranges": chunk.ranges, "times": chunk.times}
    words = _core.shot_words(chunk.points, **beams, **lengths)
    sizes = {"n_levels": 4, "enough": 80, "fewest_passes": 5.0, "most_noise": 0.03}
    sample = _core.SurfaceSample(edge=0.05, **sizes)
    sample.add(words, own=np.ones(len(chunk), np.bool_))
    sample.refine()
    with pytest.raises(RuntimeError, match="used up"):
        sample.refine()
    with pytest.raises(ValueError, match="edge: expected a positive number"):
        _core.SurfaceSample(edge=0.0, **sizes)
    with pytest.raises(ValueError, match="pass_length: expected a positive number"):
        _core.shot_words(chunk.points, **beams, edge=0.05, pass_length=0.0)
