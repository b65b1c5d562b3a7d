# SPDX-License-Identifier: MIT OR Apache-2.0
"""Results that get their name by one renaming."""

from __future__ import annotations

import json

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.fleet.folder import publish, staging_of
from support.finished_runs import finished_run

POINTS = np.random.default_rng(2).uniform(-5, 5, (50, 3))


@pytest.fixture
def place(tmp_path):
    return tmp_path / "north"


@pytest.fixture
def make(place):
    """Make a run of a request where results are made."""

    def make(request, points=POINTS):
        staging = finished_run(staging_of(place, request), points)
        record = json.loads((staging / "run.json").read_text())
        (staging / "run.json").write_text(json.dumps({**record, "request": request}))
        return staging

    return make


def test_a_result_takes_the_place_of_an_earlier_one(place, make):
    publish(make("1"), place)
    publish(make("2", POINTS[:20]), place)
    assert json.loads((place / "run.json").read_text())["request"] == "2"
    assert [path.name for path in place.parent.iterdir()] == ["north"]


def test_the_same_result_made_twice_is_kept_once(place, make):
    publish(make("1"), place)
    before = (place / "run.json").stat().st_ino
    publish(make("1"), place)
    assert (place / "run.json").stat().st_ino == before
    assert [path.name for path in place.parent.iterdir()] == ["north"]


def test_other_bytes_of_the_same_request_are_a_bug(place, make):
    publish(make("1"), place)
    with pytest.raises(RuntimeError, match=r"differ in map\.laz"):
        publish(make("1", POINTS[:20]), place)


def test_what_is_no_run_stays(place, make):
    place.mkdir()
    (place / "thesis.tex").touch()
    with pytest.raises(UsageError, match="holds something else than a run"):
        publish(make("1"), place)
    assert (place / "thesis.tex").exists()


def test_what_a_killed_process_has_left_goes_with_the_result(place, make):
    other = staging_of(place.with_name("north.2"), "0")
    other.mkdir()
    make("0")
    publish(make("1"), place)
    assert {path.name for path in place.parent.iterdir()} == {"north", other.name}
