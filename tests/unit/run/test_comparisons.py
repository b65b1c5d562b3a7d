# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is surveyed and compared when runs come, go and change: no more than what is new."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing import _core
from bentwing.base.estimate import Estimate
from bentwing.closing.global_registration import Recorded, Stretches
from bentwing.closing.joining.matches import find_matches, parts_of
from bentwing.closing.joining.survey import Survey
from bentwing.closing.places import Agreement, Alignment, Candidate, FreeSpace, Place
from bentwing.closing.places.cloud import Surfels
from bentwing.closing.places.keypoints import Keypoints
from bentwing.closing.places.things import Things
from bentwing.recording import ImuBatch
from bentwing.run.merging import comparisons
from bentwing.run.merging.comparisons import Comparisons
from bentwing.run.settings import merge_settings
from support.finished_runs import finished_run, flight

generator = np.random.default_rng(932)


def place():
    """With every kind of value that a place can have."""
    means = generator.normal(size=(3, 3))
    surfels = Surfels(means, np.ones((3, 3, 3)), means, np.ones(3), True)
    free = FreeSpace(0.25, (0, -1, 2), (4, 4, 4), np.array([1, 5], np.int32))
    return Place((1.0, 9.0), means[0], Keypoints(means, np.ones(3), np.ones((3, 2))), means, surfels, free)  # fmt: skip


def survey_of(source):
    row = generator.normal(size=(1, 3))
    ones = np.ones(1)
    seen = _core.Surfels(
        [0.2], [0, 1], row, np.ones((1, 9)), row, ones, ones, np.ones(1, np.uint32)
    )
    inertial = ImuBatch(np.arange(5.0), np.ones((5, 3)), generator.normal(size=(5, 3)))
    segments = [Stretches(source.estimate.trajectory, [seen])]
    recorded = Recorded(source.estimate, source.payload, segments, inertial)
    return Survey(source.name, recorded, [place(), place()], [0, 0])


def compare(of_a, of_b):
    del of_a, of_b
    alignment = Alignment(generator.normal(size=(4, 4)), np.eye(6), np.zeros(3), 500)
    said = Agreement(0.6, 0.9, float("nan"), 0.1, 300, 0.005, False, Things(1, 2, 3, 4))
    return [
        Candidate(0, 1, 100.0, None, 20, alignment, said),
        Candidate(1, 0, 2.0, "too few votes"),
    ]


@pytest.fixture
def merged(tmp_path, monkeypatch):
    """Survey and compare the runs of these names; return surveys, matches and what was done."""
    monkeypatch.setattr(comparisons, "compare", compare)

    def run(*names, rate=1500.0, request=""):
        sources = []
        for name in names:
            folder = tmp_path / name
            if not folder.exists():
                finished_run(folder, np.zeros((5, 3)))
            record = json.loads((folder / "run.json").read_text())
            (folder / "run.json").write_text(json.dumps({**record, "request": name + request}))
            estimate = Estimate(flight(), None)
            sources.append(
                SimpleNamespace(name=name, folder=folder, estimate=estimate, payload=None)
            )
        kept = Comparisons(tmp_path / "kept")
        surveys = [kept.survey(one, rate, merge_settings(), survey_of) for one in sources]
        parts = parts_of(surveys)
        matches = find_matches(parts, compared=kept.of(sources, parts))
        kept.remove_others()
        return surveys, matches, (kept.done["surveys"], kept.done["comparisons"])

    return run


def told(value):
    """All of a value, NaN and arrays to the last bit."""
    with np.printoptions(threshold=10**6, floatmode="unique"):
        return repr(value)


def test_a_further_run_is_surveyed_and_compared_alone(merged):
    assert merged("a", "b", "c")[2] == (3, 3)
    assert merged("a", "b", "c")[2] == (0, 0)
    assert merged("a", "b", "c", "d")[2] == (1, 3)


def test_what_is_read_back_is_what_was_found(merged):
    first, again = merged("a", "b"), merged("a", "b")
    assert again[2] == (0, 0)
    for mine, its in zip(first[0], again[0], strict=True):
        assert told(its.places) == told(mine.places)
        assert its.segments == mine.segments
        assert its.recorded.inertial == mine.recorded.inertial
        (ours,), (theirs,) = (one.recorded.segments[0].surfels for one in (mine, its))
        for a, b in zip(ours.__getnewargs__(), theirs.__getnewargs__(), strict=True):
            assert np.array_equal(a, b)
    assert told([m.candidate for m in again[1]]) == told([m.candidate for m in first[1]])


def test_a_run_that_is_left_out_leaves_nothing_and_the_others_stay(merged, tmp_path):
    merged("a", "b", "c")
    (tmp_path / "kept" / ".survey-1.host.17.partial").write_bytes(b"of a process that was killed")
    assert merged("a", "c")[2] == (0, 0)
    assert len([*(tmp_path / "kept").iterdir()]) == 2 + 1


def test_a_run_that_changed_is_surveyed_and_compared_again(merged):
    merged("a", "b")
    assert merged("a", "b", request=" with another window")[2] == (2, 1)


def test_a_longer_site_takes_other_surfels_and_the_same_places(merged):
    merged("a", "b")
    assert merged("a", "b", rate=700.0)[2] == (2, 0)


@pytest.mark.parametrize("what", ["survey", "comparison"])
def test_what_is_damaged_is_found_again(merged, tmp_path, what):
    merged("a", "b")
    path = next((tmp_path / "kept").glob(f"{what}-*"))
    path.write_bytes(path.read_bytes()[:-50])
    assert merged("a", "b")[2] == ((1, 0) if what == "survey" else (0, 1))
