# SPDX-License-Identifier: MIT OR Apache-2.0
"""Areas as geographic and drawing programs write them."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.map.polygon import Polygon
from bentwing.map.polygon_file import DEGREES, read_area

RING = [[10.0, 0.0, 5.0], [14.0, 0.0, 5.0], [14.0, 3.0, 5.0], [10.0, 0.0, 5.0]]
CORNERS = [[10, 0], [14, 0], [14, 3]]
AREA = {"type": "Polygon", "coordinates": [RING]}


def feature(geometry):
    return {"type": "Feature", "properties": {}, "geometry": geometry}


def written(path, described):
    path.write_text(json.dumps(described))
    return path


@pytest.mark.parametrize(
    "described",
    [
        AREA,
        {"type": "MultiPolygon", "coordinates": [[RING]]},
        feature(AREA),
        {"type": "GeometryCollection", "geometries": [AREA, {"type": "Point", "coordinates": [1, 2]}]},
        {"type": "FeatureCollection", "features": [feature(None), feature(AREA)]},
    ],
)  # fmt: skip
def test_geojson_gives_its_areas_however_they_are_wrapped(tmp_path, described):
    found = read_area(written(tmp_path / "area.geojson", described))
    assert found.polygons == (Polygon.of(CORNERS),)
    assert found.can_be_degrees
    assert found.epsg is None


@pytest.mark.parametrize(
    ("name", "epsg"),
    [
        ("urn:ogc:def:crs:EPSG::25832", 25832),
        ("EPSG:2056", 2056),
        ("urn:ogc:def:crs:OGC:1.3:CRS84", DEGREES),
    ],
)
def test_the_system_that_geographic_programs_write_is_read(tmp_path, name, epsg):
    described = {**AREA, "crs": {"type": "name", "properties": {"name": name}}}
    assert read_area(written(tmp_path / "area.json", described)).epsg == epsg


def test_numbers_beyond_the_globe_are_no_degrees(tmp_path):
    ring = [[[500_000, 5_400_000], [500_010, 5_400_000], [500_000, 5_400_010]]]
    described = {"type": "Polygon", "coordinates": ring}
    assert not read_area(written(tmp_path / "area.geojson", described)).can_be_degrees


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"type": "Polygon"}', '{"type": "Polygon", "coordinates": [[[0, 0]]]}',
     '{"type": "Polygon", "coordinates": [[[0, "a"], [1, 1], [2, 2]]]}', "\x00\xff",
     '{"type": "Point", "coordinates": [0, 0]}', '{"type": "FeatureCollection", "features": 3}',
     '{"type": "Polygon", "coordinates": [[[0,0],[1,0],[1,1]]], "crs": {"properties": {"name": "x"}}}'],
)  # fmt: skip
def test_what_holds_no_area_is_an_input_error_that_names_the_file(tmp_path, text):
    path = tmp_path / "area.geojson"
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(InputError, match=r"area\.geojson"):
        read_area(path)


def test_another_kind_of_file_is_refused(tmp_path):
    (tmp_path / "area.shp").touch()
    with pytest.raises(UsageError, match="GeoJSON"):
        read_area(tmp_path / "area.shp")
    with pytest.raises(InputError, match="no such file"):
        read_area(tmp_path / "none.geojson")


@pytest.fixture
def drawing(tmp_path):
    """Draw lines into a DXF and read it."""
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is an optional package")

    def draw(make, units=6):
        document = ezdxf.new(units=units)
        make(document.modelspace())
        document.saveas(tmp_path / "plan.dxf")
        return read_area(tmp_path / "plan.dxf")

    return draw


def test_closed_lines_of_a_drawing_are_areas_with_holes(drawing):
    def draw(space):
        space.add_lwpolyline([(0, 0), (10, 0), (10, 10), (0, 10)], close=True)
        space.add_circle((5, 5), 2)
        space.add_line((0, 0), (50, 50))
        space.add_lwpolyline([(20, 0), (30, 0), (30, 5)])

    (area,) = drawing(draw).polygons
    assert len(area.rings) == 2
    inside = area.contains(np.array([[1.0, 1.0], [5.0, 5.0], [5.0, 7.1], [29.0, 1.0]]))
    assert inside.tolist() == [True, False, True, False]


def test_a_drawing_in_millimetres_becomes_metres(drawing):
    def draw(space):
        space.add_lwpolyline([(0, 0), (2000, 0), (2000, 1000)], close=True)

    assert drawing(draw, units=4).polygons == (Polygon.of([[0, 0], [2, 0], [2, 1]]),)


def test_a_drawing_without_closed_lines_says_so(drawing):
    with pytest.raises(InputError, match="closed line"):
        drawing(lambda space: space.add_line((0, 0), (1, 1)))


def test_a_file_that_is_no_drawing_is_an_input_error(tmp_path):
    pytest.importorskip("ezdxf", reason="ezdxf is an optional package")
    (tmp_path / "plan.dxf").write_bytes(b"not a drawing")
    with pytest.raises(InputError, match=r"plan\.dxf"):
        read_area(tmp_path / "plan.dxf")


def test_without_ezdxf_a_drawing_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "ezdxf", None)
    (tmp_path / "plan.dxf").touch()
    with pytest.raises(UsageError, match=r"pip install bentwing\[products\]"):
        read_area(tmp_path / "plan.dxf")


def test_a_corner_that_is_not_on_earth_is_refused(tmp_path):
    far = [[0.0, 0.0], [1e12, 0.0], [0.0, 1.0], [0.0, 0.0]]
    path = written(tmp_path / "far.geojson", {"type": "Polygon", "coordinates": [far]})
    with pytest.raises(InputError, match="not on Earth"):
        read_area(path)
