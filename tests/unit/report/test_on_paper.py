# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report drawn again from a finished run, and printed."""

import json
import re
import shutil

import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.base.run_record import finished_record
from bentwing.base.trajectory import Trajectory
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map
from bentwing.recording.sections.project import Project
from bentwing.report.finished import ShownRun
from bentwing.report.pdf import BROWSER
from bentwing.report.redraw import redraw_report
from bentwing.run.folder import RunFolder

START = 1_767_225_600 * 10**9
needs_browser = pytest.mark.skipif(
    shutil.which("chromium") is None and shutil.which("google-chrome") is None,
    reason="no Chromium here: apt install chromium",
)


def room(n=60_000, seed=0):
    rng = np.random.default_rng(seed)
    points = rng.uniform([0, 0, 0], [20, 10, 3], (n, 3))
    points[np.arange(n), rng.integers(0, 3, n)] = 0.0  # floor and two walls
    return points, np.sort(rng.uniform(0, 30, n))


def way(shift=0.0):
    times = np.linspace(0.0, 30.0, 300)
    places = np.column_stack([2 + times / 2 + shift, 4 + np.sin(times), np.full(300, 1.5)])
    return Trajectory(times, places, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1)))


@pytest.fixture
def run(tmp_path):
    points, times = room()
    with RunFolder(tmp_path / "run") as folder:
        with open_map(folder.file("map.las"), "las", START) as writer:
            writer.write(MapChunk(points, times, np.ones(len(times), np.float32)))
        way().write_tum(folder.file("trajectory.txt"), START)
        folder.file("report.html").write_text("first")
    return tmp_path / "run"


def test_a_report_drawn_again_names_the_project_and_stays_part_of_the_run(run):
    assert redraw_report(run, project=Project(name="North wing")) == [run / "report.html"]
    assert "North wing" in (run / "report.html").read_text(encoding="utf-8")
    record = finished_record(run)  # refuses files that the record does not vouch for
    assert record["project"]["name"] == "North wing"
    redraw_report(run)
    assert "North wing" in (run / "report.html").read_text(encoding="utf-8")
    (run / "report.html").write_text("touched")
    with pytest.raises(Exception, match=r"report\.html"):
        redraw_report(run)


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(UsageError, match=r"run\.json"):
        redraw_report(tmp_path)


def test_without_a_browser_it_says_what_to_install_before_any_work(run, monkeypatch):
    monkeypatch.setenv(BROWSER, "no-such-browser")
    with pytest.raises(UsageError, match="install one"):
        redraw_report(run, pdf=True)
    assert (run / "report.html").read_text() == "first"


@pytest.mark.parametrize("begin_together", [True, False])
def test_runs_of_a_merged_map_follow_each_other(tmp_path, begin_together):
    starts = [START, START if begin_together else START + 1000 * 10**9]
    names = ["trajectory_a.txt", "trajectory_b.txt"]
    with RunFolder(tmp_path / "site") as folder:
        with open_map(folder.file("map.las"), "las", START) as writer:
            for i, start in enumerate(starts):
                points, times = room(1000, i)
                late = (start - START) / 1e9
                run_ids = np.full(1000, i, np.uint16)
                writer.write(
                    MapChunk(
                        points + np.array([0, 0, 10 * i]),
                        times + late,
                        np.ones(1000, np.float32),
                        run_id=run_ids,
                    )
                )
        for name, start in zip(names, starts, strict=True):
            way().write_tum(folder.file(name), start)
    record = json.loads((tmp_path / "site" / "run.json").read_text())
    record["runs"] = [
        {"name": n[11:12], "trajectory": n, "start_ns": s, "segments": [[0.0, 30.0]]}
        for n, s in zip(names, starts, strict=True)
    ]
    (tmp_path / "site" / "run.json").write_text(json.dumps(record))
    finished = ShownRun.open(tmp_path / "site")
    assert finished.trajectory.times[[0, -1]] == pytest.approx([0.0, 70.0], abs=1e-6)
    points, times = (np.concatenate(part) for part in zip(*finished.parts(), strict=True))
    assert times[points[:, 2] < 5].max() < 30.001
    assert times[points[:, 2] > 5].min() > 39.9
    assert times.max() < 70.001


@needs_browser
def test_the_paper_has_a_first_page_and_none_without_ink(run):
    pdfium = pytest.importorskip("pypdfium2", reason="pypdfium2 is not installed")
    written = redraw_report(run, project=Project(name="North wing"), pdf=True)
    assert [path.name for path in written] == ["report.html", "report.pdf"]
    assert written[1].stat().st_size < 15e6
    assert "report.pdf" in finished_record(run)["hashes"]
    document = pdfium.PdfDocument(written[1])
    assert 2 <= len(document) <= 6
    words = [page.get_textpage().get_text_range() for page in document]
    for part in ("North wing", "Plan", "Coordinates", "Left out of the map"):
        assert part in words[0], part
    assert "Settings" not in "".join(words)
    captions = ("Oblique view", "Plan by time", "Side view", "Section", "Density", "Visits")
    for page, said in zip(document, words, strict=True):
        ink = (page.render(scale=0.5).to_numpy()[..., :3] < 250).any(axis=2)
        assert ink.mean() > 0.01
        assert not ink[:, :8].any()  # nothing is cut at the edges
        assert not ink[:, -8:].any()
        pictures = sum(1 for o in page.get_objects() if o.type == pdfium.raw.FPDF_PAGEOBJ_IMAGE)
        named = sum(len(re.findall(rf"{c}\s", said)) for c in captions) + ("Plan Height" in said)
        assert pictures <= named  # each picture is on the page of its caption
