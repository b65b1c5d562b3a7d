# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which groups' maps are made, and where, when some are there already."""

from __future__ import annotations

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from bentwing.evaluate.verdict import verdict_of
from bentwing.fleet import grouping
from bentwing.run.settings import merge_settings
from support.finished_runs import finished_run


@pytest.fixture
def merge(tmp_path, monkeypatch):
    """Merge groups of names whose maps cost nothing; return the groups' folders and which were made."""
    made: dict[str, str] = {}
    fresh: list[str] = []

    def make_map(out, group, found, described, settings, *, request):
        del group, found, settings
        shutil.rmtree(out, ignore_errors=True)
        finished_run(out, np.zeros((5, 3)))
        for other in [key for key, folder in made.items() if folder == str(out)]:
            del made[other]
        made[request] = str(out)
        fresh.append(described["folder"])
        return SimpleNamespace(verdict=verdict_of([]))

    def run(*groups, spacing=0.0, rate=1500.0):
        fresh.clear()
        sources = [
            SimpleNamespace(name=name, folder=tmp_path / name, verdict=verdict_of([]))
            for group in groups
            for name in group
        ]
        found = SimpleNamespace(sources=sources, record={})
        fakes = {
            "open_sources": lambda folders, _moved: folders,
            "replace": lambda folder, name: next(s for s in sources if s.name == name),  # noqa: ARG005
            "settled": lambda settings, _: settings,
            "budget_of": lambda *_: SimpleNamespace(rate=rate),
            "find_groups": lambda *_: (list(groups), found),
            "describe_map": lambda _, group, __: {
                "runs": list(group),
                "n_links": 1,
                "joins": [],
                "graph": {},
            },
            "make_map": make_map,
        }
        for name, fake in fakes.items():
            monkeypatch.setattr(grouping, name, fake)
        runs = {source.name: str(source.folder) for source in sources}
        settings = merge_settings(map_spacing=spacing)
        answer = grouping.merge_groups(
            runs,
            tmp_path / "groups",
            settings,
            dict(made),
            kept=tmp_path / "kept",
            recordings={},
            progress=None,
        )
        return [one["folder"] for one in answer["groups"]], list(fresh)

    return run


def test_groups_are_numbered_and_a_run_by_itself_has_no_map(merge):
    assert merge(("a", "b"), ("c",), ("d", "e")) == (["1", None, "2"], ["1", "2"])


def test_a_group_that_is_there_keeps_its_map_and_its_number(merge):
    merge(("a", "b"), ("d", "e"))
    assert merge(("d", "e"), ("a", "b", "c")) == (["2", "1"], ["1"])


@pytest.mark.parametrize("change", [{"spacing": 0.1}, {"rate": 700.0}])
def test_what_changes_the_bytes_of_a_map_makes_it_anew(merge, change):
    merge(("a", "b"))
    assert merge(("a", "b")) == (["1"], [])
    assert merge(("a", "b"), **change) == (["1"], ["1"])
