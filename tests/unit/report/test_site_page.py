# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page of many runs."""

from __future__ import annotations

import re

import pytest

from bentwing.base.run_record import RUN_FOLDER
from bentwing.report.site import write_site_page


def recording(name, state="good", **values):
    return {
        "name": name, "state": state, "reason": None, "folder": f"recordings/{name}",
        "seconds": 61.0, "points": 1_234_567, **values,
    }  # fmt: skip


def group(*runs, folder="groups/1", state="good"):
    return {"runs": runs, "folder": folder, "state": state, "reason": None, "n_links": 3}


@pytest.fixture
def page(tmp_path):
    """Write the page of a record beside the records of its runs, and return it."""

    def page(recordings, groups=None, failure=None, places=None):
        for one in recordings:
            if one["folder"]:
                (tmp_path / one["folder"]).mkdir(parents=True)
                run = {"kind": RUN_FOLDER.kind, "files": ["map_top.png", "report.html"]}
                RUN_FOLDER.write(tmp_path / one["folder"], run)
        record = {"recordings": recordings, "groups": groups, "failure": failure, "places": places}
        write_site_page(tmp_path / "index.html", record)
        return (tmp_path / "index.html").read_text(encoding="utf-8")

    return page


def test_every_recording_has_a_row_with_its_picture_and_its_report(page):
    text = page([recording("morning"), recording("a b#%&<i>")])
    links = re.findall(r'(?:href|src)="([^"]+)"', text)
    assert "recordings/morning/report.html" in links
    assert "recordings/morning/map_top.png" in links
    assert "recordings/a%20b%23%25%26%3Ci%3E/map_top.png" in links
    assert "a b#%&amp;&lt;i&gt;" in text
    assert "<i>" not in text
    assert "1.23 M" in text
    assert "All recordings are mapped" in text


def test_what_is_not_mapped_is_named_in_front_and_has_no_picture(page):
    bad = recording("bad", "refused", folder=None, reason="cut <off>", seconds=0.0, points=0)
    text = page([recording("morning"), bad])
    assert "1 good, 1 refused" in text
    box = text[text.index('class="verdict bad"') : text.index("</ul>")]
    assert "bad (refused): cut &lt;off&gt;" in box
    assert "recordings/bad" not in text


@pytest.mark.parametrize(
    ("groups", "says"),
    [
        ([group("a", "b")], "All recordings are mapped<"),
        ([group("a"), group("b", folder="recordings/b")], "2 separate maps, whose relative poses are unknown: a; b"),
    ],
)  # fmt: skip
def test_separate_maps_are_named(page, groups, says):
    assert says in page([recording("a"), recording("b")], groups)


def test_a_map_says_what_the_positions_of_its_runs_rest_on(page):
    joins = [
        {"runs": ["a", "b"], "n_places": 4, "has_loop": True},
        {"runs": ["b", "<c>"], "n_places": 1, "has_loop": False},
    ]
    reason = "a single place joins <c> and b, and nothing confirms it"
    one = {**group("a", "b", "<c>", state="doubtful"), "reason": reason, "joins": joins}
    text = page([recording("a"), recording("b"), recording("c")], [one])
    weak = "&lt;c&gt; and b: a single place; no other place and no loop of recordings confirms it"
    strong = "b and a: 4 places, confirmed by a loop of recordings"
    assert text.index(weak) < text.index(strong)
    box = text[text.index('class="verdict warn"') : text.index("</ul>")]
    assert "the map is to be checked" in box
    assert "a, b, &lt;c&gt; (doubtful): a single place joins" in box


def test_a_merging_that_failed_is_named(page):
    text = page([recording("a"), recording("b")], [group("a"), group("b")], "the <disk> is full")
    assert "The runs were not merged: the &lt;disk&gt; is full" in text
