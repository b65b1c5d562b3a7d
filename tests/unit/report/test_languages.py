# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report in its second language: nothing on the first page, and no heading, is left in English."""

import dataclasses
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.kinds import KINDS
from bentwing.evaluate.verdict.verdict import verdict_of
from bentwing.recording.sections.project import Project
from bentwing.report.german import GERMAN
from bentwing.report.page import write_report
from bentwing.report.sections import verdict
from bentwing.report.texts import ENGLISH, Texts

SPHERE = {"kind": "sphere", "sigma": 0.0031, "normal": None}
RECORD = {
    "complete": True, "start_ns": 1_767_225_600 * 10**9, "started": "2026-03-04T09:12:44+00:00",
    "segments": [[0.0, 30.0]], "versions": {"bentwing": "1.2.3"},
    "inputs": [{"name": "yard.mcap", "bytes": 10**6, "sha256": "ab" * 32, "hashed": "all"}],
    "settings": {"payload": {"name": "MX-7", "lidar": {"kind": "vlp-16"}}, "loop_closure": {"x": 1}},
    "counts": {"lidar.returns": 1_000_000, "lidar.nan": 90_000, "preprocess.range": 70, "preprocess.self_hits": 1,
               "preprocess.no_encoder_angle": 1, "map.outside_trajectory": 1, "map.mixed_pixels": 1, "map.moving": 1,
               "map.thinned": 1, "map.points": 899_300, "map.written": 899_300},
    "verdict": verdict_of([Evidence("loop", 0.04), Evidence("matches", 9.0, ((1.0, 2.5),), {"share": 41.2})]).to_json(),
    "set_up": [{"sentence": "§", "line": "§"}],
    "expected_accuracy": {"horizontal": 0.0116, "vertical": 0.104, "heading": 0.001, "horizontal_per_10m": 0.0025,
                          "vertical_per_10m": 0.001, "heading_per_10m": 0.0005, "map_thickness": 0.0075},
    "map": {"refinement": {"moved": 0.9, "move": 0.003, "sigma_before": 0.012, "sigma": 0.004}},
    "georeference": {
        "epsg": 32632, "crs": "WGS 84 / UTM zone 32N", "mode": "rigid", "heights": "above the ellipsoid (WGS 84)",
        "fixes": {"fixes": 300, "used": 297, "rejected": 3, "rms_horizontal": 0.01, "rms_vertical": 0.02,
                  "runs": [{"name": "§", "used": 1, "rejected": 0, "offset": None}]},
        "linear": {"map": [0, 0, 0], "projected": [631_015.0, 5_170_950.0, 497.0], "matrix": np.eye(3).tolist()},
        "residuals": {"control": {"n": 2, "rms": 0.0012, "max": 0.0014}, "check": {"n": 1, "rms": 0.004, "max": 0.004}},
        "control_points": [
            {"id": "M1", "use": "control", "normal": [0, 0, 1], "before": -0.0051, "residual": 0.0012, "in_map": [2, 3, 0], "picked_off": 0.02},
            {"id": "M2", "use": "check", "normal": [1, 0, 0], "before": 0.002, "residual": -0.004, "in_map": [4, 3, 0]},
            {"id": "M3", "use": "control", "normal": None, "before": None, "residual": None, "in_map": [9, 3, 0]},
            {"id": "M4", "use": "control", "before": 0.002, "residual": 0.001, "in_map": [9, 4, 0], **SPHERE},
            {"id": "M5", "use": "control", "before": None, "residual": None, "in_map": [9, 5, 0], **SPHERE},
            {"id": "M6", "use": "control", "normal": [1, 0, 1], "before": 0.2, "residual": 0.2, "in_map": [9, 6, 0], "contradicts": True},
        ],
    },
    "beams": {"offsets": np.zeros((2, 4)).tolist(), "std": np.zeros((2, 4)).tolist(), "table": [0.1, 0.2],
              "roughness": [0.02, 0.01], "n_returns": 5, "n_planes": 2},
    "merging": {"maps": [{"folder": ".", "runs": ["§"], "n_links": 1}], "candidates": []},
    "windows": [{"time": t, "degenerate": t > 20, "n_matches": 9} for t in range(1, 31)],
}  # fmt: skip
# Names, signs and units are the same in all languages.
SAME = re.compile(
    r"(?<!\w)(§|MX-7 \(vlp-16\)|yard\.mcap|M\d|WGS 84 / UTM zone 32N|Instrument|N|bentwing|payload\.yaml|info|UTC|"
    r"EPSG|GNSS|MB|SHA-256|mm|min|m²|m³|m|s|x|y|z|°|%)(?!\w)"
)


class Words(HTMLParser):
    """Texts of a page: all on the first page, headings and names of figures elsewhere."""

    def __init__(self, page):
        super().__init__()
        self.open, self.first, self.heads = [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if tag not in {"meta", "br", "input", "link", "img"}:
            self.open.append((tag, attrs.get("class") or "", attrs.get("lang")))
        if "cover" in [c for _, c, _ in self.open] and "aria-label" in attrs:
            self.first.append(attrs["aria-label"])

    def handle_startendtag(self, tag, attrs):
        pass

    def handle_endtag(self, tag):
        while self.open and self.open.pop()[0] != tag:
            pass

    def handle_data(self, data):
        tags = [tag for tag, _, _ in self.open]
        if not data.strip() or {"style", "script"} & {*tags}:
            return
        if any(c == "cover" for _, c, _ in self.open) and not any(
            tag == "li" and lang == "en" for tag, _, lang in self.open
        ):
            self.first.append(data.strip())
        in_caption = "figcaption" in tags and tags[-1] == "b"
        if {"h1", "h2", "h3", "summary", "title", "button"} & {*tags} or in_caption:
            self.heads.append(data.strip())


def written(folder, language):
    rng = np.random.default_rng(0)
    points = rng.uniform([0, 0, 0], [20, 10, 0.01], (60_000, 3))
    times = np.linspace(0.0, 30.0, 300)
    way = np.column_stack([2 + times / 2, 4 + np.sin(times), np.full(300, 1.5)])
    path = folder / f"{language}.html"
    values = np.column_stack([0.01 * points[:, 0], points[:, 1], 0.3 * points[:, 0]])
    write_report(
        path,
        run_json={
            **RECORD,
            "project": {"name": "§", "language": language},
            "warnings": ["Some words."],
        },
        trajectory=Trajectory(times, way, np.tile([0.0, 0.0, 0.0, 1.0], (300, 1))),
        map_sample=(points, rng.uniform(0, 30, 60_000)),
        map_values=values.astype(np.float32),
        spin=(times, times),
    )
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("languages")
    return {language: written(folder, language) for language in ("en", "de")}


def words(text):
    """What is left to say of a text without names, units and numbers."""
    return re.sub(r"[^A-Za-zÄÖÜäöüß]+", " ", SAME.sub("", text)).strip()


def test_nothing_on_the_first_page_and_no_heading_is_left_in_english(pages):
    english, german = (Words(pages[language]) for language in ("en", "de"))
    for part in ("first", "heads"):
        left = {words(text) for text in getattr(english, part)} - {""}
        assert len(left) > 20
        same = left & {words(text) for text in getattr(german, part)}
        assert not same


def test_numbers_and_dates_are_those_of_the_language(pages):
    first = " ".join(Words(pages["de"]).first)
    assert "04.03.2026" in first
    assert "01.01.2026" in first
    assert "1\N{NARROW NO-BREAK SPACE}000\N{NARROW NO-BREAK SPACE}000 Echos" in first
    assert "0,10\N{NO-BREAK SPACE}m in der Höhe" in first
    assert "EPSG:32632" in first
    assert not re.search(
        r"\d\.\d(?!\d*\.\d)",
        first.replace("04.03.2026", "").replace("01.01.2026", "").replace("1.2.3", ""),
    )
    assert '<html lang="de">' in pages["de"]


def test_german_has_all_words():
    for one in dataclasses.fields(Texts):
        english, german = getattr(ENGLISH, one.name), getattr(GERMAN, one.name)
        if one.name not in {"instrument"}:
            assert english != german, one.name
        if isinstance(english, dict) and english:
            assert set(english) == set(german), one.name
        if isinstance(english, str):
            fields = [set(re.findall(r"\{(\w+)", text)) for text in (english, german)]
            assert fields[0] == fields[1], one.name
    for english, german in GERMAN.phrases.items():
        assert set(re.findall(r"\{(\w+)", english)) == set(re.findall(r"\{(\w+)", german))


def test_every_kind_of_evidence_has_a_german_sentence():
    assert set(GERMAN.findings) == set(KINDS)
    for kind, (finding, advice) in GERMAN.findings.items():
        known = set(re.findall(r"\{(\w+)", KINDS[kind].finding)) | {"value", "percent", "when"}
        assert set(re.findall(r"\{(\w+)", finding)) <= known, kind
        assert advice != KINDS[kind].advice


def test_a_reason_of_an_earlier_version_keeps_its_sentence():
    record = {
        "complete": True,
        "verdict": verdict_of([Evidence("matches", 9.0, (), {"share": 41.2})]).to_json(),
    }
    assert "41 % der wieder gesehenen Flächen" in verdict(record, GERMAN)
    del record["verdict"]["reasons"][0]["facts"]
    assert "41 % of the surfaces seen again" in verdict(record, GERMAN)


def test_a_language_that_no_report_knows_is_refused(tmp_path):
    path = tmp_path / "project.yaml"
    path.write_text("language: fr\n", encoding="utf-8")
    with pytest.raises(InputError, match="language"):
        Project.load(path)
