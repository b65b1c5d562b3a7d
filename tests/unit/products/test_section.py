# SPDX-License-Identifier: MIT OR Apache-2.0
import re
from xml.etree import ElementTree as ET

import numpy as np
import pytest
from PIL import Image
from pyproj import CRS

from bentwing.base.errors import InputError, UsageError
from bentwing.products import CutPlane, section_of, write_section
from bentwing.products.sheet import SCALES, lay_out
from support.known_points import rooms, write_run

ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed")


def test_a_plan_has_the_walls_of_the_rooms(office):
    found = section_of(office, 1.0)
    assert found.floor == pytest.approx(0.0, abs=0.01)
    assert found.plane.origin[2] == pytest.approx(1.0, abs=0.01)
    lengths = np.linalg.norm(found.lines[:, 1] - found.lines[:, 0], axis=1)
    assert lengths[:6] == pytest.approx([10, 10, 4, 4, 4, 4], abs=0.02)
    assert len(found.lines) == 6
    # 1500 points per square metre are 26 mm apart.
    assert found.spacing == pytest.approx(1500**-0.5, rel=0.25)


def test_an_upright_section_shows_floor_ceiling_and_the_walls_between(office):
    found = section_of(office, CutPlane.upright((0.5, 2.0), (9.5, 2.0)), thickness=0.3)
    assert found.points[:, 0].min() >= 0.0
    assert found.points[:, 0].max() <= 9.0
    levels = sorted(round(float(line[:, 1].mean()), 2) for line in found.lines)
    assert levels == [0.0, 1.5, 1.5, 3.0]
    walls = sorted(float(line[:, 0].mean()) for line in found.lines if np.ptp(line[:, 1]) > 1)
    assert walls == pytest.approx([5.5, 5.62], abs=0.01)


def test_a_level_plane_through_a_point_is_a_plan(office):
    by_height = section_of(office, CutPlane.level(1.0))
    by_point = section_of(office, CutPlane.through((0.0, 0.0, 1.0), (0.0, 0.0, 2.0)))
    assert by_point == by_height
    assert by_height.floor is None


def test_a_drawing_is_true_to_scale_in_the_model_and_on_paper(office, tmp_path):
    found, paper = write_section(office, tmp_path / "plan.dxf", 1.0, scale=50)
    assert paper == "1:50 on A4"
    document = ezdxf.readfile(tmp_path / "plan.dxf")
    audit = document.audit()
    assert not audit.errors
    assert not audit.fixes
    assert document.units == ezdxf.units.M
    model = document.modelspace()
    assert {e.dxf.layer for e in model} == {"POINTS", "WALLS", "GRID", "TITLE"}
    walls = [(e.dxf.start, e.dxf.end) for e in model if e.dxf.layer == "WALLS"]
    drawn = sorted((a.distance(b) for a, b in walls), reverse=True)
    lengths = np.linalg.norm(found.lines[:, 1] - found.lines[:, 0], axis=1)
    assert drawn == pytest.approx(sorted(lengths, reverse=True), abs=1e-9)
    assert len([e for e in model if e.dxf.layer == "POINTS"]) > 1000
    (view,) = [v for v in document.layout("A4 1-50").viewports() if v.dxf.status != 1]
    assert view.dxf.view_height / view.dxf.height == pytest.approx(0.05)
    assert (view.dxf.width, view.dxf.height) == (297, 210)


def test_a_drawing_has_its_size_in_millimetres(office, tmp_path):
    found, _ = write_section(office, tmp_path / "plan.svg", 1.0, scale=50)
    root = ET.parse(tmp_path / "plan.svg").getroot()
    assert (root.get("width"), root.get("height")) == ("297mm", "210mm")
    assert root.get("viewBox") == "0 0 297 210"
    lines = [e.get("points") for e in root.iter() if e.tag.endswith("polyline")
             and e.get("stroke-width") == "0.35" and e.get("points").count(",") == 2]  # fmt: skip
    mm = [np.array([p.split(",") for p in line.split()], float) for line in lines]
    lengths = sorted((float(np.linalg.norm(b - a)) for a, b in mm), reverse=True)
    # 10 m are 200 mm at 1:50; the arrow and the legend are drawn as wide as walls.
    expected = 20 * np.linalg.norm(found.lines[:, 1] - found.lines[:, 0], axis=1)
    assert lengths[:6] == pytest.approx(expected, abs=0.02)
    texts = [e.text for e in root.iter() if e.tag.endswith("text")]
    assert {"1:50", "y", "Plan 1.00 m above the floor"} <= set(texts)
    assert any("ground sample distance" in text for text in texts)


def test_a_picture_prints_at_its_size(office, tmp_path):
    write_section(office, tmp_path / "plan.png", 1.0)
    with Image.open(tmp_path / "plan.png") as image:
        size = 25.4 * np.array(image.size) / image.info["dpi"]
        assert size == pytest.approx([297, 210], abs=0.1)
        dark = np.asarray(image.convert("L")) < 100
    assert dark.any()
    write_section(office, tmp_path / "plan.pdf", 1.0)
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+)", (tmp_path / "plan.pdf").read_bytes())
    assert [float(v) / 72 * 25.4 for v in box.groups()] == pytest.approx([297, 210], abs=0.1)


def test_coordinates_of_a_map_on_the_earth_are_those_of_the_drawing(tmp_path):
    there = np.array([640_512.3, 5_333_207.6, 243.0])
    run = write_run(tmp_path / "run", rooms() + there, crs_wkt=CRS(32632).to_wkt("WKT1_GDAL"))
    found, _ = write_section(run, tmp_path / "plan.dxf", 1.0)
    assert found.floor == pytest.approx(243.0, abs=0.01)
    assert found.lines.reshape(-1, 2).min(axis=0) == pytest.approx(there[:2], abs=0.02)
    model = ezdxf.readfile(tmp_path / "plan.dxf").modelspace()
    starts = np.array([e.dxf.start for e in model if e.dxf.layer == "WALLS"])
    assert np.allclose(np.sort(starts[:, 0]), np.sort(found.lines[:, 0, 0]), atol=1e-6)
    texts = [e.dxf.text for e in model.query("TEXT")]
    assert "N" in texts
    assert any("EPSG:32632" in text for text in texts)


def test_the_scale_is_the_largest_that_fits_and_the_paper_the_smallest():
    sheet = lay_out(np.zeros(2), np.array([10.0, 4.0]))
    assert (sheet.scale, sheet.paper) == (50, "A4")
    assert lay_out(np.zeros(2), np.array([10.0, 4.0]), 20).paper == "A2"
    assert lay_out(np.zeros(2), np.array([4.0, 10.0]), 50).size == (210, 297)
    assert all(lay_out(np.zeros(2), np.full(2, 0.2 * s)).scale in SCALES for s in (3, 77, 900))


def test_a_scale_for_which_no_paper_is_large_enough_names_one_that_works(office, tmp_path):
    with pytest.raises(UsageError, match=r"--scale 5: .*more than A0 holds; give 10 or more"):
        write_section(office, tmp_path / "plan.svg", 1.0, scale=5)
    assert not (tmp_path / "plan.svg").exists()


def test_a_height_where_nothing_is_says_where_something_is(office):
    with pytest.raises(
        InputError, match=r"give --plan between -0\.0\d and 3\.0\d m above the floor"
    ):
        section_of(office, 12.0)
    with pytest.raises(InputError, match=r"heights are from -0\.0\d to 3\.0\d m"):
        section_of(office, CutPlane.level(-7.0))
    with pytest.raises(InputError, match="none between its ends"):
        section_of(office, CutPlane.upright((50.0, 0.0), (60.0, 0.0)))


@pytest.mark.parametrize("thickness", [0.0, -1.0, np.nan, np.inf])
def test_a_thickness_that_is_none_is_refused(office, thickness):
    with pytest.raises(UsageError, match="--thickness"):
        section_of(office, 1.0, thickness=thickness)


def test_a_slab_that_holds_everything_is_drawn(office, tmp_path):
    found, _ = write_section(office, tmp_path / "plan.svg", 1.0, thickness=1e6)
    assert found.counts.sum() == len(rooms())


def test_a_height_that_is_no_number_is_refused(office):
    with pytest.raises(UsageError, match="--plan nan"):
        section_of(office, np.nan)


def test_a_run_without_trajectory_has_its_floor_from_all_columns(tmp_path):
    run = write_run(tmp_path / "run", rooms())
    assert section_of(run, 1.0).floor == pytest.approx(0.0, abs=0.01)


def test_a_map_without_points_is_refused(tmp_path):
    run = write_run(tmp_path / "run", np.empty((0, 3)))
    with pytest.raises(InputError, match="holds no point"):
        section_of(run)


def test_a_file_that_exists_is_not_overwritten(office, tmp_path):
    (tmp_path / "plan.svg").write_text("mine")
    with pytest.raises(UsageError, match="exists already"):
        write_section(office, tmp_path / "plan.svg")
    assert (tmp_path / "plan.svg").read_text() == "mine"


@pytest.mark.parametrize("name", ["plan.dwg", "nowhere/plan.svg"])
def test_a_file_that_cannot_be_written_is_refused_before_the_work(office, tmp_path, name):
    with pytest.raises(UsageError, match=r"must end with|there is no folder"):
        write_section(office, tmp_path / name)
