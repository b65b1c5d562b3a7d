# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished site takes further runs and lets runs go: with maps that take no time."""

from __future__ import annotations

import json

import pytest

from bentwing.base.errors import UsageError
from bentwing.base.progress import LineProgress, Progress
from bentwing.fleet.joining import join_site, runs_of
from bentwing.fleet.opened import side_by_side
from bentwing.fleet.plan import Choice
from bentwing.fleet.site import map_site

from .conftest import write_run


@pytest.fixture
def site(work, manifest, tmp_path):
    """A site of two runs that belong together and one that does not, and one that was refused."""
    path = manifest(a1="1", a2="2", b1="3", bad="refused")
    opened = side_by_side(None, Progress())
    made = map_site([path], tmp_path / "site", Choice(), opened, Progress())
    work.calls.clear()
    return made.out


@pytest.fixture
def join(site):
    def join(*paths, **given):
        opened = side_by_side(None, Progress())
        return join_site(list(paths), site, given, opened, Progress())

    return join


def groups(site):
    return [group.runs for group in site.groups]


def test_a_further_run_joins_its_group_and_nothing_is_mapped(site, join, work, tmp_path):
    later = tmp_path / "elsewhere" / "b2"
    write_run(later, "of b2", [])
    found = join(site, later)
    assert groups(found) == [("a1", "a2"), ("b1", "b2")]
    assert [group.is_earlier for group in found.groups] == [True, False]
    assert work.calls == {"merge": 1, "b1-b2": 1}
    record = json.loads((site / "site.json").read_text())
    assert [one["name"] for one in record["recordings"]] == ["a1", "a2", "b1", "b2"]
    assert record["recordings"][3]["folder"] == "../elsewhere/b2"
    work.calls.clear()
    assert groups(join(site)) == groups(found)
    assert not work.calls


def test_the_runs_that_are_given_remain_and_the_others_are_named(site, work, capsys):
    given = [site / "recordings" / "a2", site / "recordings" / "b1"]
    found = join_site(given, site, {}, side_by_side(None, Progress()), LineProgress())
    assert "no longer in the site: a1; to keep them" in capsys.readouterr().err
    assert groups(found) == [("a2",), ("b1",)]
    assert set(work.calls) == {"merge"}
    assert (site / "recordings" / "a1" / "map.laz").is_file()


def test_a_run_of_the_same_name_gets_another_and_those_that_are_there_keep_theirs(
    site, join, tmp_path
):
    write_run(tmp_path / "a1", "of another", [])
    found = join(tmp_path / "a1", site)
    assert [one.name for one in found.recordings] == ["a1", "a2", "b1", "a1_2"]
    assert found.recordings[0].folder == site / "recordings" / "a1"


def test_settings_are_those_of_the_site_unless_others_are_given(site, join, work):
    join(site, map_spacing=0.5)
    assert set(work.calls) == {"merge"}
    assert json.loads((site / "site.json").read_text())["merging"]["map_spacing"] == 0.5
    work.calls.clear()
    join(site)
    assert not work.calls


def test_what_is_no_finished_run_is_refused_and_the_site_stays(site, join, tmp_path):
    before = (site / "site.json").read_bytes()
    (tmp_path / "empty").mkdir()
    with pytest.raises(UsageError, match="holds no bentwing run"):
        join(site, tmp_path / "empty")
    assert (site / "site.json").read_bytes() == before


def test_a_site_is_what_it_was_until_the_new_maps_are_made(site, join, tmp_path):
    write_run(tmp_path / "b2", "of b2", [])
    before = (site / "site.json").read_bytes()
    with pytest.raises(KeyboardInterrupt):
        join_site([site, tmp_path / "b2"], site, {}, interrupted, Progress())
    assert (site / "site.json").read_bytes() == before
    assert groups(join(site, tmp_path / "b2")) == [("a1", "a2"), ("b1", "b2")]


def interrupted(*_):
    """Stands for a pool in which the user stops the work."""
    raise KeyboardInterrupt


def test_a_site_that_is_not_complete_is_no_list_of_runs(site):
    record = json.loads((site / "site.json").read_text())
    (site / "site.json").write_text(json.dumps({**record, "complete": False}))
    with pytest.raises(UsageError, match="finish it with `bentwing fleet`"):
        runs_of([site])
