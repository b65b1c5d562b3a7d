# SPDX-License-Identifier: MIT OR Apache-2.0
import base64
import re
import sys
from html.parser import HTMLParser

import numpy as np
import pytest

from bentwing.base import geometry
from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.verdict import Evidence, verdict_of
from bentwing.report import write_report
from bentwing.report.calibration import calibration_table
from bentwing.report.facts import coordinates
from bentwing.report.on_earth import on_earth_section
from bentwing.report.texts import ENGLISH

RECORD = {
    "complete": True,
    "stage": "done",
    "reason": None,
    "started": "2026-03-04T09:12:44+00:00",
    "versions": {"bentwing": "0.1.0", "numpy": "2.0"},
    "inputs": [{"name": "yard.mcap", "bytes": 10**6, "sha256": "ab" * 32, "hashed": "all"}],
    "settings": {"estimator": "continuous", "payload": {"self_hits": [], "name": "head"}},
    "counts": {"map.points": 12_345_678, "preprocess.range": 3},
    "timings": {"estimate": 4.0, "estimate/solve": 1.0, "total": 5.0},
    "warnings": [],
    "peak_memory_mb": 512.0,
    "calibration": {
        "latency": 0.00213,
        "mount": {"T_imu_lidar": {"translation": [0.0312, 0, -0.05], "quaternion": [0, 0, 0, 1]}},
        "gyro_bias": [0.001, 0.0, 0.0],
        "accel_bias": [0.02, 0.0, 0.0],
        "gravity": [0.0, 0.0, 9.81],
        "std": {"latency": [2e-5], "extrinsic_translation": [4e-4] * 3},
    },
    "windows": [
        {"time": float(t), "n_matches": 100 + t, "n_fixed_matches": 50, "inlier_share": 0.9,
         "residual_rms": None if t == 3 else 1.0, "n_surfels": 500}
        for t in range(10)
    ],
}  # fmt: skip


def trajectory():
    times = 0.01 * np.arange(1000)
    turns = np.stack([0 * times, 0 * times, np.mod(4 * times, 6) - 3], axis=1)
    return Trajectory(
        times, np.stack([times, np.sin(times), 1 + 0 * times], axis=1), geometry.exp(turns)
    )


def sample(n=5000):
    rng = np.random.default_rng(0)
    points = rng.uniform([-5, -5, 0], [15, 5, 0.1], (n, 3))
    return points, rng.uniform(0, 9.9, n)


NO_POINTS = (np.empty((0, 3)), np.empty(0))


class Page(HTMLParser):
    void = ("meta", "br", "img", "input")

    def __init__(self):
        super().__init__()
        self.open, self.links, self.counts = [], [], {}

    def handle_starttag(self, tag, attrs):
        self.counts[tag] = self.counts.get(tag, 0) + 1
        self.links += [v for k, v in attrs if k in {"src", "href"}]
        if tag not in self.void:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def written(path, **changes):
    values = {"run_json": RECORD, "trajectory": trajectory(), "map_sample": sample()}
    values["spin"] = (trajectory().times, np.full(1000, 4.4))
    write_report(path / "report.html", **{**values, **changes})
    text = (path / "report.html").read_text()
    page = Page()
    page.feed(text)
    assert page.open == []
    return text, page


@pytest.fixture(scope="module")
def whole_page(tmp_path_factory):
    return written(tmp_path_factory.mktemp("report"))


def test_the_page_has_all_parts_and_needs_no_network(whole_page):
    text, page = whole_page
    for heading in (
        "Map",
        "Coverage",
        "Agreement of the map with itself",
        "Motion",
        "Estimate, window by window",
        "Calibration",
        "Record",
    ):
        assert f"<h2>{heading}" in text
    for part in ("Oblique view", "Plan by time", "Density", "Visits", "Side view", "Section", "Rate of turn",
                 "Position", "Matches", "Inliers", "Residual", "Surfels", "yard.mcap"):  # fmt: skip
        assert part in text
    assert page.counts["svg"] == 5 + 2 + 3 + 4 + 1  # and what is measured in the view
    assert all(link.startswith("data:image/png;base64,") for link in page.links)
    assert not re.search(r"https?://(?!www\.w3\.org/2000/svg)", text)
    assert "<script src" not in text


def test_the_pictures_are_png(whole_page):
    _, page = whole_page
    for link in page.links:
        assert base64.b64decode(link.split(",")[1]).startswith(b"\x89PNG\r\n\x1a\n")


def test_numbers_appear_with_their_deviations(whole_page):
    text, _ = whole_page
    for number in (
        "2.130",
        "± 0.020",
        "31.2",
        "± 0.4",
        "12 M",
        "512.0",
    ):
        assert number in text, number


def test_a_motor_mount_is_shown_with_its_three_parts():
    pose = {"translation": [0.01, 0.0, 0.05], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    encoder = {"T_imu_motor": pose, "axis": [0, 0, 1], "zero": 0.01, "T_motor_lidar": pose}
    std = {"encoder_zero": [1e-4], "motor_tilt": [2e-4, 3e-4], "motor_offset": [1e-3, 2e-3]}
    html = calibration_table({**RECORD["calibration"], "mount": {"encoder": encoder}, "std": std})
    for text in ("motor in IMU", "encoder zero", "0.573", "± 0.006", "lidar in motor", "± 2.0"):
        assert text in html, text
    assert "wobble" not in html


def test_how_a_motor_turns_otherwise_than_its_encoder_reads_is_shown():
    pose = {"translation": [0.01, 0.0, 0.05], "quaternion": [0.0, 0.0, 0.0, 1.0]}
    encoder = {"T_imu_motor": pose, "axis": [0, 0, 1], "zero": 0.01, "T_motor_lidar": pose}
    errors = {"eccentricity": [1e-3, -2e-3], "wobble": [[0.0, 0.0, 5e-4, 0.0], [0.0] * 4]}
    std = {"encoder_eccentricity": [1e-4, 2e-4], "motor_wobble": [1e-5] * 8}
    mount = {"encoder": encoder | errors}
    html = calibration_table({**RECORD["calibration"], "mount": mount, "std": std})
    for text in ("encoder eccentricity", "0.057", "-0.115", "± 0.011", "motor wobble", "0.029"):
        assert text in html, text


def test_what_the_inertial_unit_does_wrong_is_shown_where_it_was_estimated():
    unit = InertialUnit(gyro=np.diag([0.0, 0.0, 0.0123]), g_sensitivity=np.full((3, 3), 1e-4))
    std = {"gyro_scale": [1e-3, 1e-3, 2e-4], "g_sensitivity": [1e-5] * 9}
    html = calibration_table({**RECORD["calibration"], "unit": unit.to_json(), "std": std})
    for text in ("gyro scale, %", "1.230", "± 0.020", "g-sensitivity, °/s/g", "0.056", "± 0.006"):
        assert text in html, text
    assert "accelerometer scale" not in html


def test_what_is_wrong_with_the_ranges_is_shown_where_it_was_found_or_described():
    ranges = {"offset": -0.0287, "grazing": 0.0}
    html = calibration_table(
        {**RECORD["calibration"], "ranges": ranges, "std": {"range_offset": [9.8e-4]}}
    )
    for text in ("ranges too long, mm", "-28.7", "± 1.0"):
        assert text in html, text
    assert "under 45°" not in html
    described = calibration_table({**RECORD["calibration"], "ranges": ranges, "std": {}})
    assert "-28.7" in described
    assert "ranges" not in calibration_table({**RECORD["calibration"], "std": {}})


def test_the_page_is_the_same_without_a_drawing_library(tmp_path, whole_page, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert written(tmp_path)[1].counts == whole_page[1].counts


@pytest.mark.parametrize(
    ("changes", "headline", "level"),
    [
        ({}, "Map finished<", "good"),
        ({"warnings": ["Head stalled."]}, "Map finished<", "good"),
        ({"verdict": verdict_of([]).to_json()}, "Good: ", "good"),
        ({"verdict": verdict_of([Evidence("gravity", 0.9)]).to_json()}, "Doubtful: ", "warn"),
        ({"verdict": verdict_of([Evidence("gravity", 9.0)]).to_json()}, "Failed: ", "bad"),
        ({"complete": False, "stage": "map", "reason": "interrupted"}, "Incomplete", "bad"),
    ],
)
def test_the_verdict_says_first_whether_the_map_can_be_used(tmp_path, changes, headline, level):
    text, _ = written(tmp_path, run_json={**RECORD, **changes}, map_sample=NO_POINTS)
    verdict = text[text.index('<div class="verdict') :][:400]
    assert headline in verdict
    assert f'class="verdict {level}"' in verdict


def test_a_run_that_failed_early_still_has_a_page(tmp_path):
    nothing = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))
    record = {"complete": False, "stage": "start", "reason": "no lidar"}
    text, _ = written(
        tmp_path, run_json=record, trajectory=nothing, map_sample=NO_POINTS, spin=None
    )
    assert "no lidar" in text
    assert "No points were mapped" in text


@pytest.mark.parametrize("n", [1, 2])
def test_very_few_points_and_poses_are_drawn(tmp_path, n):
    few = Trajectory(
        trajectory().times[:n], trajectory().positions[:n], trajectory().quats_xyzw[:n]
    )
    text, page = written(tmp_path, trajectory=few, map_sample=(sample()[0][:n], np.zeros(n)))
    assert "<h2>Map" in text
    assert page.counts["figure"] > 10
    assert page.counts["image"] == 5
    assert "nan" not in text.lower()


def test_names_from_outside_cannot_become_markup(tmp_path):
    evil = "<script>alert(1)</script>"
    record = {**RECORD, "warnings": [evil], "settings": {evil: evil}, "reason": evil}
    record["inputs"] = [{"name": evil, "bytes": 1, "sha256": evil, "hashed": evil}]
    text, page = written(tmp_path, run_json=record, map_sample=NO_POINTS)
    assert "script" not in page.counts
    assert evil not in text


def test_the_place_on_the_earth_has_its_name_and_the_share_of_each_run():
    found = {
        "epsg": 25832, "crs": "ETRS89 / UTM zone 32N", "mode": "rigid",
        "fixes": {
            "messages": 220, "fixes": 219, "used": 212, "rejected": 7, "rms_horizontal": 0.012, "rms_vertical": 0.02, "no_fix": 1,
            "runs": [
                {"name": "morning", "used": 105, "rejected": 4, "offset": [0.001, 0, -0.006]},
                {"name": "noon", "used": 0, "rejected": 0, "offset": None},
            ],
        },
    }  # fmt: skip
    shown = on_earth_section(found)
    assert "ETRS89 / UTM zone 32N (EPSG:25832)" in coordinates({"georeference": found}, ENGLISH)
    for part in ("212 used, 7 left out", "12 mm horizontally, 20 mm vertically", "1 with no fix"):
        assert part in shown, part
    assert "morning" in shown
    assert "+0.001, +0.000, \N{MINUS SIGN}0.006" in shown
    assert "{" not in shown
