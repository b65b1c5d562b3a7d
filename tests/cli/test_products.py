# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sections, terrain and volumes as a user asks for them."""

from __future__ import annotations

import json

import numpy as np
import pytest

from support.known_points import rooms, write_run

SQUARE = [[[1, 1], [5, 1], [5, 3], [1, 3], [1, 1]]]


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    way = np.column_stack([np.linspace(1, 9, 50), np.full(50, 2.0), np.full(50, 1.2)])
    return write_run(tmp_path_factory.mktemp("products") / "run", rooms(), way=way)


def test_a_plan_is_drawn_and_the_result_said(bentwing, finished, tmp_path):
    done = bentwing("section", finished, "-o", tmp_path / "plan.svg")
    assert done.code == 0, done.err
    assert "1:50 on A4" in done.out
    assert "6 walls of 36.0 m; floor at height" in done.out
    assert (tmp_path / "plan.svg").read_text().startswith("<svg")


def test_an_upright_cut_may_begin_at_negative_coordinates(bentwing, finished, tmp_path):
    done = bentwing("section", finished, "--plane=-1,2,11,2", "-o", tmp_path / "cut.svg")
    assert done.code == 0, done.err


def test_a_grid_for_planners_is_two_files(bentwing, finished, tmp_path):
    done = bentwing(
        "section", finished, "--plan", "0.9", "--thickness", "1.4", "-o", tmp_path / "plan.yaml"
    )
    assert done.code == 0, done.err
    assert "m² free" in done.out
    assert (tmp_path / "plan.pgm").read_bytes().startswith(b"P5\n")


def test_the_ground_of_rooms_is_their_floor(bentwing, finished, tmp_path):
    done = bentwing("terrain", finished, "-o", tmp_path / "dtm.tif")
    assert done.code == 0, done.err
    assert "heights from -0.0" in done.out


def test_nothing_lies_on_a_floor(bentwing, finished, tmp_path):
    area = tmp_path / "area.geojson"
    area.write_text(json.dumps({"type": "Polygon", "coordinates": SQUARE}))
    done = bentwing("volume", finished, "--area", area, "--json")
    assert done.code == 0, done.err
    found = json.loads(done.out)
    assert abs(found["volume"]) < 2 * found["sigma"]
    assert found["area"] == 8.0
    assert bentwing("volume", finished, "--area", area).out.endswith("is counted\n")


def test_a_mesh_is_written_and_the_result_said(bentwing, finished, tmp_path):
    pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)
    done = bentwing("mesh", finished, "--spacing", "0.2", "-o", tmp_path / "mesh.ply")
    assert done.code == 0, done.err
    assert "points 20 cm apart" in done.out
    assert (tmp_path / "mesh.ply").read_bytes().startswith(b"ply\n")


def test_a_mesh_of_another_kind_is_refused(bentwing, finished, tmp_path):
    done = bentwing("mesh", finished, "-o", tmp_path / "mesh.stl")
    assert done.code == 2
    assert "must end with .ply or .obj or .glb" in done.err


@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (["--plan", "12"], 3, "give --plan between"),
        (["--plan", "nan"], 2, "--plan nan cannot be used"),
        (["--level", "inf"], 2, "--level inf cannot be used"),
        (["--plan", "1", "--level", "2"], 2, "give one of them"),
        (["--plane", "1,1,1,1"], 2, "is no plane"),
        (["--plane", "0,0,0,0,0,0"], 2, "is no plane"),
        (["--plane", "1,2,three,4"], 2, "is no plane"),
        (["--thickness", "nan"], 2, "--thickness nan cannot be used"),
        (["--scale", "0"], 2, "--scale 0 cannot be used"),
        (["--scale", "1"], 2, "more than A0 holds; give 10 or more"),
    ],
)
def test_a_wrong_call_is_one_sentence(bentwing, finished, tmp_path, arguments, code, said):
    done = bentwing("section", finished, *arguments, "-q", "-o", tmp_path / "plan.png")
    assert done.code == code
    assert said in done.err
    assert len(done.err.splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("command", ["section", "terrain"])
def test_a_folder_without_a_run_is_refused(bentwing, tmp_path, command):
    done = bentwing(command, tmp_path, "-o", tmp_path / "plan.png")
    assert done.code == 2
    assert "holds no bentwing run" in done.err
