# SPDX-License-Identifier: MIT OR Apache-2.0
"""An office without GNSS is mapped onto the grid of its site by five marks: the commands of docs/site_grid.md."""

from __future__ import annotations

import json
import re
import shutil

import ezdxf
import laspy
import numpy as np
import pytest

from bentwing.evaluate.simulated import Truth
from support.surveyed_marks import Seen, SiteGrid, write_marks

pytestmark = pytest.mark.slow

SEED = 107
GRID = SiteGrid()
FOOT = (0.0, 0.0, -0.2)  # m, the point below the IMU that stands on a mark
FLOORS = (False, True, False, False, True)
USES = ("control", "control", "control", "check", "check")


@pytest.fixture(scope="module")
def flight(made_once):
    return made_once("site-grid-flight", lambda folder: command("simulate", "office", "--duration", 30,
                     "--seed", SEED, "-o", folder))  # fmt: skip


def command(*arguments):
    from bentwing.cli.main import run_command

    assert run_command([*map(str, arguments), "--quiet"]) == 0


def mapped(flight, out, *options):
    payload = flight / "payload.yaml"
    command("map", flight / "recording.bag", "-p", payload, "-o", out, *options)
    return out


@pytest.fixture(scope="module")
def first(flight, made_once):
    """The map in its own frame, in which the marks are looked for."""
    return made_once("site-grid-first", lambda folder: mapped(flight, folder))


@pytest.fixture(scope="module")
def marks(flight, first):
    """Five marks as the surveyor has them, each seen in the map to a centimetre."""
    rng, seen = np.random.default_rng(SEED), Seen(flight, first)
    places = seen.places(rng, FLOORS)
    in_map = seen.in_map(places) + rng.normal(0.0, 0.01, places.shape)
    return [
        {"Punkt": f"M{n + 1}", **dict(zip(("East", "North", "Height"), grid, strict=True)),
         **dict(zip(("map_x", "map_y", "map_z"), there, strict=True)), "use": use}
        for n, (grid, there, use) in enumerate(zip(GRID.of(places), in_map, USES, strict=True))
    ]  # fmt: skip


@pytest.fixture(scope="module")
def office(flight, marks, made_once):
    """The map on the grid."""

    def fill(folder):
        path = write_marks(folder.parent / "marks.csv", marks, separator=";", decimal=",")
        mapped(flight, folder, "--control-points", path)

    return made_once("site-grid-office", fill)


def record_of(run):
    return json.loads((run / "run.json").read_text())


def off(flight, run):
    """Distances (N,) m of the written points from the true surfaces of the site."""
    grid = np.array(laspy.read(run / "map.laz").xyz)[::20]
    return np.abs(Truth(flight).distances(GRID.to_world(grid)))


def test_the_map_is_on_the_grid_to_millimetres(flight, office):
    record = record_of(office)
    left = record["georeference"]["residuals"]
    assert (left["control"]["n"], left["check"]["n"]) == (3, 2)
    assert left["check"]["max"] < 0.005
    assert record["georeference"]["contradictions"] == []
    assert record["verdict"]["state"] == "good"
    assert np.median(off(flight, office)) < 0.006


def test_the_first_page_has_the_residuals_the_grid_and_the_accuracy(office):
    page = (office / "report.html").read_text()
    cover = page[page.index('<section class="cover') : page.index("<h2>Map</h2>")]
    for part in (
        "Expected accuracy",
        "Frame of the control points",
        "Check points (2)",
        "grid is that of the control",
    ):
        assert part in cover, part
    assert all(f"<td>M{n}</td>" in cover for n in range(1, 6))


def test_the_plan_is_a_drawing_on_the_grid(office, tmp_path):
    drawing = tmp_path / "plan.dxf"
    command("section", office, "-o", drawing)
    walls = [e for e in ezdxf.readfile(drawing).modelspace() if e.dxf.layer == "WALLS"]
    assert len(walls) > 10
    ends = np.array([[*wall.dxf.start] for wall in walls])
    assert np.abs(ends[:, :2] - GRID.shift[:2]).max() < 60.0


@pytest.mark.skipif(
    shutil.which("chromium") is None and shutil.which("google-chrome") is None,
    reason="no Chromium here: apt install chromium",
)
def test_the_report_is_printed(office):
    command("report", office, "--pdf")
    assert len(re.findall(rb"/Type\s*/Page\b", (office / "report.pdf").read_bytes())) in range(3, 7)


def test_a_mark_that_is_a_decimetre_wrong_is_named(flight, marks, tmp_path, bentwing):
    wrong = [dict(mark) for mark in marks]
    wrong[0]["Height"] += 0.1
    path = write_marks(tmp_path / "marks.csv", wrong)
    said = bentwing("map", flight / "recording.bag", "-p", flight / "payload.yaml", "-o", tmp_path / "run",
                    "--control-points", path)  # fmt: skip
    assert said.code == 0
    assert "doubtful: M1 lies 0." in said.out
    record = record_of(tmp_path / "run")
    assert record["georeference"]["residuals"]["control"]["n"] == 2
    assert record["verdict"]["reasons"][0]["kind"] == "marks"
    assert "not used: contradicts the others" in (tmp_path / "run/report.html").read_text()


def test_marks_on_which_the_head_stood_need_no_places_in_the_map(flight, first, tmp_path):
    """It stood at the start, and was over two other marks at known times."""
    rng, seen = np.random.default_rng(SEED), Seen(flight, first)
    ways = np.linalg.norm(seen.truth.positions - seen.truth.positions[0], axis=1)
    far = float(seen.truth.times[ways.argmax()])
    marks = [
        {"id": f"S{time:.1f}", **dict(zip("xyz", GRID.of(seen.under_the_head(time, FOOT)), strict=True)),
         "time": time, "sigma": 0.005, **dict(zip(("foot_x", "foot_y", "foot_z"), FOOT, strict=True)),
         "radius": 0.01, "use": "control"}
        for time in (0.3, far / 2, far)
    ]  # fmt: skip
    marks += [
        {"id": f"W{n}", **dict(zip("xyz", grid, strict=True)), "radius": 0.3, "use": "check"}
        for n, grid in enumerate(GRID.of(seen.places(rng, FLOORS)))
    ]
    path = write_marks(tmp_path / "marks.csv", marks)
    run = mapped(flight, tmp_path / "run", "--control-points", path)
    georeference = record_of(run)["georeference"]
    assert georeference["residuals"]["check"]["n"] == 5
    assert georeference["residuals"]["check"]["rms"] < 0.02
    assert georeference["contradictions"] == []
    assert np.median(off(flight, run)) < 0.02
