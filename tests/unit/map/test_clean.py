# SPDX-License-Identifier: MIT OR Apache-2.0
import functools
import tracemalloc

import numpy as np
import pytest

from bentwing import _core
from bentwing.map.chunk import MapChunk
from bentwing.map.clean import CleanSettings, clean

DURATION = 20.0
ROOM = np.array([4.0, 3.0, 2.5])  # m, half of it: the lidar is in the middle of a box
BODY = np.array([0.25, 0.25, 0.9])  # m, half of a box that moves along y
NOISE = 0.01


def cast(directions, low, high):
    """Ranges and normals of the near (from outside) and far (from inside) faces of a box."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = low / directions, high / directions
    near, far = np.minimum(first, second), np.maximum(first, second)
    return near, far


def scene_at(times, directions):
    """Ranges of a still room with a box walking through it; whether the box was hit; normals."""
    _, far = cast(directions, -ROOM, ROOM)
    axis = far.argmin(axis=1)
    ranges = far[np.arange(len(far)), axis]
    middle = np.stack([np.full(len(times), 2.0), -2.2 + 0.9 * (times % 5.0), 0 * times - 1.6], 1)
    near, far = cast(directions, middle - BODY, middle + BODY)
    entry, out = near.max(axis=1), far.min(axis=1)
    is_body = (entry > 0) & (entry < out) & (entry < ranges) & (times > 6.0) & (times < 10.0)
    axis = np.where(is_body, near.argmax(axis=1), axis)
    return np.where(is_body, entry, ranges), is_body, axis


@functools.cache
def recording(n=400_000, chunk=50_000, seed=1):
    rng = np.random.default_rng(seed)
    times = np.sort(rng.uniform(0, DURATION, n))
    directions = rng.normal(size=(n, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    ranges, is_body, axis = scene_at(times, directions)
    ranges = ranges + NOISE * rng.normal(size=n)
    chunks = [
        MapChunk(
            directions[part] * ranges[part, None],
            times[part],
            ranges[part].astype(np.float32),
            beams=directions[part].astype(np.float32),
            doubtful=np.zeros(chunk, np.bool_),
        )
        for part in np.split(np.arange(n), n // chunk)
    ]
    return chunks, is_body, axis, directions


def kept(chunks, tmp_path, counts=None, **settings):
    found = clean(
        iter(chunks),
        tmp_path,
        duration=DURATION,
        settings=CleanSettings(**settings),
        counts=counts,
    )
    return list(found)


def test_a_body_that_walked_through_is_removed_and_the_room_stays(tmp_path):
    chunks, is_body, _, _ = recording()
    counts = {}
    times = np.concatenate([c.times for c in kept(chunks, tmp_path, counts)])
    stays = np.isin(np.concatenate([c.times for c in chunks]), times)
    assert is_body.sum() > 700
    assert np.mean(~stays[is_body]) > 0.95
    assert np.mean(~stays[~is_body]) < 0.001
    assert counts == {"map.mixed_pixels": 0, "map.moving": int(np.sum(~stays))}
    assert list(tmp_path.iterdir()) == []


def test_what_moved_is_kept_when_asked(tmp_path):
    chunks, _, _, _ = recording(n=100_000)
    assert sum(map(len, kept(chunks, tmp_path, moving=False))) == 100_000


def test_incidence_and_thickness_are_those_of_the_walls(tmp_path):
    chunks, is_body, axis, directions = recording()
    found = kept(chunks, tmp_path, moving=False)
    incidence = np.concatenate([c.incidence for c in found])
    thickness = np.concatenate([c.thickness for c in found])
    cosines = np.abs(directions[np.arange(len(axis)), axis])
    off = np.degrees(np.abs(incidence - np.arccos(cosines)))[~is_body]
    # along the edges of the room two walls share a cell
    assert np.nanmedian(off) < 1.5
    # across the wall only a share of the noise along the beam is seen
    across = cosines * NOISE
    assert 0.8 < np.nanmedian(thickness[~is_body] / across[~is_body]) < 1.25
    assert np.isnan(thickness).mean() < 0.01


def test_a_doubtful_return_in_the_open_is_removed_and_one_on_a_wall_stays(tmp_path):
    chunks = recording(n=100_000, seed=2)[0]
    first = chunks[0]
    first.doubtful[:2] = True
    first.points[0] *= 0.5
    first.ranges[0] *= 0.5
    counts = {}
    found = kept(chunks, tmp_path, counts, moving=False)
    assert counts["map.mixed_pixels"] == 1
    assert first.times[0] not in found[0].times
    assert first.times[1] in found[0].times


@pytest.mark.parametrize("threads", [1, 2])
def test_the_result_is_the_same_with_any_number_of_threads(tmp_path, threads):
    chunks, _, _, _ = recording(n=100_000)
    reference = kept(chunks, tmp_path)
    again = list(clean(iter(chunks), tmp_path, duration=DURATION, threads=threads))
    for a, b in zip(reference, again, strict=True):
        assert a.incidence.tobytes() == b.incidence.tobytes()
        assert a.thickness.tobytes() == b.thickness.tobytes()
        assert np.array_equal(a.times, b.times)


def test_no_chunks_give_no_chunks(tmp_path):
    assert kept([], tmp_path) == []


def test_cells_are_joined_where_there_are_too_many():
    rng = np.random.default_rng(0)
    points = np.ascontiguousarray(np.c_[rng.uniform(-9, 9, (50_000, 2)), np.zeros(50_000)])
    ranges = np.linalg.norm(points - [0, 0, 2.0], axis=1)
    beams = ((points - [0, 0, 2.0]) / ranges[:, None]).astype(np.float32)

    def edge(most):
        survey = _core.MapSurvey(
            edge=0.2, max_cells=most, start=0.0, step=0.5, max_rays=1000, margin=0.4
        )
        survey.add(
            points,
            beams=beams,
            ranges=ranges.astype(np.float32),
            times=np.zeros(len(points)),
            doubtful=np.zeros(len(points), np.bool_),
        )
        cells = survey.finish()
        assert cells.n_cells <= most
        assert cells.n_rays <= 1000
        thickness = cells.describe(points, beams=beams)[1]
        assert np.nanmax(thickness) < 1e-4
        return cells.edge

    assert edge(1_000_000) == 0.2
    assert edge(3000) == 0.4
    assert edge(100) > 1.0


def test_memory_does_not_grow_with_the_number_of_points(tmp_path):
    chunks, _, _, _ = recording(n=100_000, chunk=10_000)

    def peak(n):
        tracemalloc.start()
        stream = (chunks[i % len(chunks)] for i in range(n))
        for _ in clean(stream, tmp_path, duration=DURATION):
            pass
        most = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return most

    assert peak(30) < 1.3 * peak(10)


def test_bad_arguments_are_named():
    survey = _core.MapSurvey(edge=0.2, max_cells=9, start=0.0, step=0.5, max_rays=9, margin=0.4)
    values = {
        "beams": np.zeros((2, 3), np.float32),
        "ranges": np.zeros(2, np.float32),
        "times": np.zeros(2),
        "doubtful": np.zeros(2, np.bool_),
    }
    with pytest.raises(ValueError, match="ranges: expected 2 rows"):
        survey.add(np.zeros((2, 3)), **{**values, "ranges": np.zeros(1, np.float32)})
    survey.finish()
    with pytest.raises(RuntimeError, match="finished"):
        survey.add(np.zeros((2, 3)), **values)
    with pytest.raises(ValueError, match="edge: expected a positive"):
        _core.MapSurvey(edge=0.0, max_cells=9, start=0.0, step=0.5, max_rays=9, margin=0.4)
