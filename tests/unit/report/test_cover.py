# SPDX-License-Identifier: MIT OR Apache-2.0
"""The first page of a report, as a client reads it."""

import re

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.trajectory import Trajectory
from bentwing.report.cover import cover, title_of
from bentwing.report.drawn import Drawn
from bentwing.report.facts import coordinates, job, left_out
from bentwing.report.frame import ShownFrame
from bentwing.report.picture import View
from bentwing.report.plan import Mark, draw_plan
from bentwing.report.texts import ENGLISH
from bentwing.report.way import Way

START = 1_767_225_600 * 10**9  # 2026-01-01 00:00 UTC
PROJECT = {"name": "North wing", "site": "Elm Street 4", "client": "City", "operator": "A. Muster",
           "time_zone": "Europe/Zurich"}  # fmt: skip
TURN = np.radians(30.0)
LINEAR = {
    "map": [1.0, 2.0, 0.5],
    "projected": [500_123.0, 5_200_456.0, 410.0],
    "matrix": [[np.cos(TURN), -np.sin(TURN), 0], [np.sin(TURN), np.cos(TURN), 0], [0, 0, 1]],
}
GEOREFERENCE = {
    "epsg": 32632, "crs": "WGS 84 / UTM zone 32N", "mode": "rigid", "linear": LINEAR,
    "heights": "above the ellipsoid", "fixes": {"fixes": 300, "used": 297, "rejected": 3},
    "residuals": {"control": {"n": 1, "rms": 0.0012, "max": 0.0012}, "check": {"n": 1, "rms": 0.004, "max": 0.004}},
    "control_points": [
        {"id": "M1", "use": "control", "points": 50, "normal": [0, 0, 1], "before": -0.0051, "residual": 0.0012, "in_map": [2, 3, 0]},
        {"id": "M2", "use": "check", "points": 50, "normal": [1, 0, 0], "before": 0.002, "residual": -0.004, "in_map": [4, 3, 0]},
        {"id": "M3", "use": "control", "points": 0, "normal": None, "before": None, "residual": None, "in_map": [9, 3, 0]},
    ],
}  # fmt: skip
RECORD = {
    "complete": True, "start_ns": START, "segments": [[2.0, 12.0]], "started": "2026-03-04T09:12:44+00:00",
    "inputs": [{"name": "yard.mcap"}, {"name": "payload.yaml"}],
    "settings": {"payload": {"name": "head 7", "lidar": {"kind": "vlp-16"}, "project": PROJECT}},
    "counts": {"lidar.returns": 10_000, "lidar.nan": 900, "lidar.inf": 100, "preprocess.range": 7,
               "map.moving": 4, "map.points": 8_993, "map.written": 8_989},
    "georeference": GEOREFERENCE,
    "expected_accuracy": {"horizontal": 0.011, "vertical": 0.004, "heading": 0.001, "horizontal_per_10m": 0.002,
                          "vertical_per_10m": 0.001, "heading_per_10m": 0.0005, "map_thickness": 0.007},
}  # fmt: skip


def trajectory(n=200):
    times = np.linspace(2.0, 12.0, n)
    way = np.column_stack([times, np.sin(times), np.full(n, 1.0)])
    return Trajectory(times, way, np.tile([0.0, 0.0, 0.0, 1.0], (n, 1)))


@pytest.fixture(scope="module")
def page():
    rng = np.random.default_rng(0)
    points = rng.uniform([0, -5, 0], [20, 5, 0.01], (400_000, 3))
    return cover(Drawn.of(RECORD, trajectory(), (points, rng.uniform(2, 12, 400_000)), ENGLISH))


def test_it_says_for_whom_where_when_by_whom_and_with_what():
    rows = dict(job(RECORD, trajectory(), ENGLISH))
    assert rows["Client"] == "City"
    assert rows["Operator"] == "A. Muster"
    assert rows["Instrument"] == "head 7 (vlp-16)"
    assert re.fullmatch(r"2026-01-01, 01:00:02 . 01:00:12 CET", rows["Recorded"])
    assert rows["Recording"] == "yard.mcap"
    assert "Contractor" not in rows
    assert title_of(RECORD, ENGLISH) == "Mapping report · North wing"


def test_settings_of_a_run_name_the_project_before_the_payload():
    record = {**RECORD, "settings": {**RECORD["settings"], "project": {"name": "Other"}}}
    assert dict(job(record, trajectory(), ENGLISH))["Project"] == "Other"


def test_a_clock_that_does_not_know_the_date_gives_none():
    rows = dict(job({**RECORD, "start_ns": 12 * 10**9}, trajectory(), ENGLISH))
    assert rows["Recorded"] == ENGLISH.unknown_time


@pytest.mark.parametrize(
    ("found", "part"),
    [
        (GEOREFERENCE, "WGS 84 / UTM zone 32N (EPSG:32632)"),
        ({"mode": "rigid", "linear": LINEAR}, "without an EPSG code"),
        (None, "Local frame"),
    ],
)
def test_the_coordinates_have_a_name(found, part):
    assert part in coordinates({"georeference": found}, ENGLISH)


def test_what_was_left_out_is_counted_with_its_share():
    said = left_out(RECORD, ENGLISH)
    assert "1,000 (10.0 %) without an echo" in said
    assert "4 (below 0.1 %) on things that moved" in said
    assert "3 of 300 GNSS fixes that do not agree with the others" in said
    assert "control points of which no flat surface or sphere was found: M3" in said


def test_the_page_has_plan_numbers_accuracy_and_marks(page):
    for part in ("North wing", "Expected accuracy", "11\N{NO-BREAK SPACE}mm", "EPSG:32632", "Check points (1): 4.0 mm",
                 "+1.2", "\N{MINUS SIGN}4.0", "sideways", "not used", "Grid north is up", ">M1<", ">M2<"):  # fmt: skip
        assert part in page, part
    assert float(re.search(r"<b>(\d+) m²", page)[1]) == pytest.approx(200, rel=0.05)
    for part in ("epsg", "log₁₀", "rms", "degenerate", "32,632"):
        assert part not in re.sub(r"data:image[^\"]*", "", page), part


def test_the_shown_frame_is_that_of_the_written_coordinates():
    frame, rng = ShownFrame.of(GEOREFERENCE), np.random.default_rng(1)
    points = rng.uniform(-50, 50, (20, 3))
    linear = (points - LINEAR["map"]) @ np.array(LINEAR["matrix"]).T + LINEAR["projected"]
    np.testing.assert_allclose(frame.points(points) + frame.origin, linear, atol=1e-8)
    turned = frame.trajectory(trajectory())
    yaw = geometry.log(turned.quats_xyzw)[:, 2]
    np.testing.assert_allclose(yaw, TURN, atol=1e-12)
    assert frame.is_north_up
    assert not ShownFrame.of(None).is_north_up


def plan(frame, marks=()):
    view = View(np.full((400, 600, 3), 255, np.uint8), 0.05, -10.0, 12.0, 0.0, 3.0)
    x = np.linspace(-5, 5, 50)
    return draw_plan(view, frame, way=Way(x, x), marks=marks)


def test_the_grid_has_round_coordinates_and_north_only_on_the_earth():
    local, placed = plan(ShownFrame()), plan(ShownFrame.of(GEOREFERENCE))
    assert re.findall(r">(-?\d+)</text>", local)
    assert ">N<" not in local
    assert ">N<" in placed
    assert ">500,105<" in placed
    assert ">5,200,505<" in placed


def test_names_of_marks_do_not_lie_on_each_other():
    marks = [Mark(f"M{i}", (0.1 * i, 0.0), is_check=i > 3) for i in range(8)]
    drawn = plan(ShownFrame(), marks)
    named = re.findall(r'<text x="([\d.]+)" y="([\d.]+)" font-size="22" fill="#000"', drawn)
    places = np.array(named, float)
    apart = np.abs(places[:, None] - places[None])
    clear = (apart[..., 0] > 24) | (apart[..., 1] > 17) | np.eye(len(places), dtype=bool)
    assert len(places) >= 2
    assert clear.all()
