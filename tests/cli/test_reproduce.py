# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing reproduce fu2023` and `tazir2020` as a user runs them, and twice the same."""

import json
from dataclasses import replace

import pytest

from bentwing.reproduce import campaign, reproduce, tazir2020, tazir_walls

pytestmark = pytest.mark.slow


def test_fu_is_reproduced_in_a_hurry_and_better_than_the_paper(bentwing, tmp_path):
    out = tmp_path / "out"
    result = bentwing("reproduce", "fu2023", "--quick", "--seed", "2", "-o", out)
    assert result.code == 0, result.err
    assert "| Outdoor | kalman (theirs: Ours) | 0.599 |" in result.out
    assert (
        result.out.count("Failed") >= 10
    )  # three scenes with the rotation ignored, and the paper's
    page = (out / "report.html").read_text()
    names = {path.stem for path in out.glob("*.png")}
    assert {"fig07a", "fig08_x", "fig09b_y", "fig10b", "fig11_error", "fig12a", "why_b"} <= names
    assert page.count("<figure") == len(names) == len(list(out.glob("*.svg")))
    assert "Why R-FAST-LIO fails" in page
    found = json.loads((out / "mapping.json").read_text())
    assert found["mocap, turning"]["kalman"]["ate_mean_m"] < 0.017
    assert found["mocap, turning"]["continuous"]["ate_mean_m"] < 0.010
    assert found["campus, turning"]["kalman"]["ate_mean_m"] < 0.10
    assert all(found[f"{scene}, turning"]["R-FAST-LIO"]["failed"] for scene in ("mocap", "campus"))
    # Recordings are large and can be had again.
    assert {path.suffix for path in out.iterdir()} == {".html", ".json", ".md", ".png", ".svg"}


def test_the_tables_of_tazir_are_the_same_bytes_whoever_makes_them(tmp_path, monkeypatch):
    short = [replace(f, quick_duration=6.0) for f in tazir2020.FLIGHTS]
    monkeypatch.setattr(tazir2020, "FLIGHTS", tuple(short))
    walls = [replace(f, quick_duration=1.0) for f in tazir_walls.WALLS]
    monkeypatch.setattr(tazir2020, "WALLS", tuple(walls))
    made = []
    for workers in (1, 2):
        monkeypatch.setattr(campaign, "_WORKERS", workers)
        out = tmp_path / f"{workers}"
        reproduce("tazir2020", out, quick=True, seed=4)
        pictures = sorted(path.name for path in out.glob("*.png"))
        files = ["mapping.md", *pictures]
        made.append([(name, (out / name).read_bytes()) for name in files])
    assert made[0] == made[1]
    table = made[0][0][1].decode()
    assert table.count("| ndt |") == table.count("| continuous |") == 5
    assert "nan" not in table
    names = {name for name, _ in made[0]}
    assert {
        "fig04.png",
        "fig06b.png",
        "fig07a_x.png",
        "fig10.png",
        "fig13b.png",
        "fig15.png",
    } <= names
