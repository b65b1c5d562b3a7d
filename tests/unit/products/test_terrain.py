# SPDX-License-Identifier: MIT OR Apache-2.0
import json

import laspy
import numpy as np
import pytest
from PIL import Image
from pyproj import CRS

from bentwing.base.errors import InputError, UsageError
from bentwing.products import terrain_of, write_terrain
from bentwing.products.ground import ground_cells
from support.known_points import write_run

SIGMA = 0.01
THERE = np.array([640_500.0, 5_333_200.0, 240.0])


def hill(places):
    """Terrain with slopes up to 30 %."""
    x, y = places.T
    return 0.15 * x + 0.6 * np.sin(y / 4.0)


def site(seed=130):
    """Points on a hill of 40 x 30 m with a house of 8 x 6 m and trees, and which are ground."""
    rng = np.random.default_rng(seed)
    places = rng.uniform((-20, -15), (20, 15), (120_000, 2))
    under = (np.abs(places - [5.0, 3.0]) < [4.0, 3.0]).all(axis=1)
    ground = np.column_stack([places, hill(places) + rng.normal(0, SIGMA, len(places))])[~under]
    roof = np.column_stack([places[under], np.full(under.sum(), 5.0)])
    trees = []
    for x, y in rng.uniform((-18, -13), (-2, 13), (15, 2)):
        n = 1500
        crown = rng.normal((x, y, hill(np.array([[x, y]]))[0] + 4.0), 0.8, (n, 3))
        turn, up = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 3, n)
        trunk = np.column_stack([x + 0.15 * np.cos(turn), y + 0.15 * np.sin(turn), up])
        trunk[:, 2] += hill(trunk[:, :2])
        trees += [crown, trunk]
    objects = np.concatenate([roof, *trees])
    points = np.concatenate([ground, objects])
    is_ground = np.arange(len(points)) < len(ground)
    order = rng.permutation(len(points))
    return points[order], is_ground[order]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    points, _ = site()
    folder = tmp_path_factory.mktemp("hill") / "run"
    return write_run(folder, points + THERE, crs_wkt=CRS(32632).to_wkt("WKT1_GDAL"))


def test_the_terrain_is_the_hill_without_house_and_trees(run):
    found = terrain_of(run)
    places = found.centres().reshape(-1, 2) - THERE[:2]
    wrong = found.heights.ravel() - THERE[2] - hill(places)
    measured = found.measured.ravel()
    # 6 points in a cell of 25 cm: 4 mm; a tenth of the cells have half of it or less.
    assert np.abs(np.median(wrong[measured])) < 0.001
    assert np.percentile(np.abs(wrong[measured]), 95) < 0.02
    assert np.percentile(np.abs(wrong[measured]), 99.9) < BAND_OF_A_TRUNK
    under_roof = (np.abs(places - [5.0, 3.0]) < [3.5, 2.5]).all(axis=1)
    assert not measured[under_roof].any()


BAND_OF_A_TRUNK = 0.15


def test_points_have_their_classes_and_heights_and_all_else_they_had(run, tmp_path):
    write_terrain(run, tmp_path / "classified.laz")
    _, is_ground = site()
    with laspy.open(tmp_path / "classified.laz") as file:
        found = file.read()
    with laspy.open(run / "map.laz") as file:
        before = file.read()
    classes = np.array(found.classification)
    assert set(np.unique(classes)) == {1, 2}
    assert (classes[is_ground] == 2).mean() > 0.995
    above_band = ~is_ground & (np.nan_to_num(np.array(found["height"]), nan=9.0) > 0.15)
    assert (classes[above_band] == 1).all()
    assert above_band.sum() > 0.93 * (~is_ground).sum()
    for name in ("X", "Y", "Z", "gps_time", "range"):
        assert np.array_equal(found[name], before[name])
    height = np.array(found["height"])[is_ground]
    assert np.nanstd(height) == pytest.approx(SIGMA, rel=0.15)
    assert found.header.parse_crs().to_epsg() == 32632


def test_a_raster_lies_where_the_terrain_is(run, tmp_path):
    found = write_terrain(run, tmp_path / "dtm.tif", cell=0.5)
    with Image.open(tmp_path / "dtm.tif") as image:
        values = np.asarray(image)
        assert image.tag_v2[34735][-1] == 32632
        assert image.tag_v2[33550][:2] == (0.5, 0.5)
        left, top = image.tag_v2[33922][3:5]
        assert image.tag_v2[42113] == "nan"
    assert (left, top) == (found.origin[0], found.origin[1] + 0.5 * len(found.heights))
    assert np.array_equal(values[::-1], found.heights.astype(np.float32), equal_nan=True)


def test_another_program_reads_the_raster(run, tmp_path):
    rasterio = pytest.importorskip("rasterio", reason="rasterio is not installed")
    found = write_terrain(run, tmp_path / "dtm.tif", cell=0.5)
    with rasterio.open(tmp_path / "dtm.tif") as raster:
        assert raster.crs.to_epsg() == 32632
        x, y = THERE[0] - 10.0, THERE[1] - 5.0
        (value,) = next(raster.sample([(x, y)]))
    assert value == pytest.approx(THERE[2] + hill(np.array([[-10.0, -5.0]]))[0], abs=0.1)
    assert np.isfinite(found.heights).any()


def test_contours_lie_at_their_heights(run, tmp_path):
    write_terrain(run, tmp_path / "contours.geojson", interval=0.5)
    found = json.loads((tmp_path / "contours.geojson").read_text())
    assert found["crs"]["properties"]["name"].endswith("EPSG::32632")
    assert len(found["features"]) > 5
    wrong = [
        hill(np.array(f["geometry"]["coordinates"]) - THERE[:2])
        + THERE[2]
        - f["properties"]["height"]
        for f in found["features"]
    ]
    assert np.percentile(np.abs(np.concatenate(wrong)), 90) < 0.03
    assert {f["properties"]["height"] % 0.5 for f in found["features"]} == {0.0}


def test_contours_are_drawn_at_their_heights(run, tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed")
    write_terrain(run, tmp_path / "contours.dxf", interval=0.5)
    document = ezdxf.readfile(tmp_path / "contours.dxf")
    assert not document.audit().errors
    lines = document.modelspace().query('LWPOLYLINE[layer=="CONTOURS"]')
    assert {line.dxf.elevation % 0.5 for line in lines} == {0.0}
    x, y = np.concatenate([np.array(line.get_points("xy")) for line in lines]).T
    assert (x > THERE[0] - 21).all()
    assert (y < THERE[1] + 16).all()


def test_a_map_in_another_format_is_classified_as_well(tmp_path):
    points, is_ground = site(131)
    run = write_run(tmp_path / "run", points, map_format="ply")
    write_terrain(run, tmp_path / "classified.las")
    found = laspy.read(tmp_path / "classified.las")
    assert np.abs(np.stack([found.x, found.y, found.z], axis=1) - points).max() < 1e-4
    assert (np.array(found.classification)[is_ground] == 2).mean() > 0.995


def test_a_house_is_no_ground_and_a_terrace_is():
    rng = np.random.default_rng(132)
    grid = rng.normal(0, SIGMA, (80, 80))
    grid[20:50, 20:44] += 4.0  # 7.5 x 6 m
    grid[:, 60:] += 2.0  # goes on to the edge
    ground = ground_cells(grid, 0.25)
    assert not ground[20:50, 20:44].any()
    assert ground[:, :15].all()
    assert ground[:, 75:].all()


def test_nothing_is_ground_where_nothing_was_seen():
    assert not ground_cells(np.full((5, 5), np.nan), 0.25).any()


def test_a_flat_site_has_no_contour_and_that_is_said(tmp_path):
    rng = np.random.default_rng(133)
    flat = np.column_stack([rng.uniform(0, 5, (9000, 2)), rng.normal(0.2, 0.005, 9000)])
    run = write_run(tmp_path / "run", flat)
    with pytest.raises(InputError, match="give a smaller --interval"):
        write_terrain(run, tmp_path / "contours.geojson")


@pytest.mark.parametrize(("name", "value"), [("cell", np.nan), ("cell", -1.0), ("interval", 0.0)])
def test_numbers_that_cannot_be_used_are_refused(run, tmp_path, name, value):
    with pytest.raises(UsageError, match=f"--{name}"):
        write_terrain(run, tmp_path / "contours.geojson", **{name: value})
