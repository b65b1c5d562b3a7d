# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places cut from a stream are those cut from all points at once."""

import numpy as np
import pytest

from bentwing.base.trajectory import Trajectory
from bentwing.closing.places import PartStream, PlaceSettings, cut_places

SECONDS = 34.0


@pytest.fixture(scope="module")
def run():
    rng = np.random.default_rng(4)
    times = np.sort(rng.uniform(0.0, SECONDS, 40_000))
    times[[0, -1]] = 0.0, SECONDS
    track = np.linspace(0.0, SECONDS, 341)
    positions = np.column_stack([track, np.zeros(341), np.zeros(341)])
    upright = np.tile([0.0, 0.0, 0.0, 1.0], (341, 1))
    return rng.normal(size=(40_000, 3)), times, Trajectory(track, positions, upright)


def streamed(run, spans, settings=None, n_chunks=37):
    points, times, trajectory = run
    stream = PartStream(trajectory, spans, settings)
    found = []
    for rows in np.array_split(np.arange(len(times)), n_chunks):
        found += stream.add(points[rows], times[rows])
    return [*found, *stream.finish()]


@pytest.mark.parametrize("n_chunks", [1, 37, 1000])
def test_a_stream_gives_the_places_of_all_points(run, n_chunks):
    together = cut_places(*run)
    found = streamed(run, [(0.0, SECONDS)], n_chunks=n_chunks)
    assert [part.span for part in found] == [part.span for part in together]
    for one, other in zip(found, together, strict=True):
        assert np.array_equal(one.points, other.points)
        assert np.array_equal(one.origins, other.origins)


def test_no_place_has_points_of_two_segments(run):
    found = streamed(run, [(0.0, 13.0), (13.5, SECONDS)])
    assert not any(part.span[0] < 13.0 < part.span[1] - 0.5 for part in found)


def test_a_place_holds_no_more_points_than_it_can_use(run):
    settings = PlaceSettings(max_points=2000)
    found = streamed(run, [(0.0, SECONDS)], settings)
    assert len(found) == len(cut_places(*run))
    assert all(1000 <= len(part.points) <= 4000 for part in found)


def test_points_outside_the_trajectory_are_passed_over(run):
    points, times, trajectory = run
    stream = PartStream(trajectory, [(0.0, SECONDS)])
    assert not [*stream.add(points, times + 100.0), *stream.finish()]
