# SPDX-License-Identifier: MIT OR Apache-2.0
"""Exports of runs whose every point is known, compared with the plainest formulas."""

from __future__ import annotations

import json
import shutil

import laspy
import numpy as np
import pytest
from evo.tools import file_interface
from laspy.copc import CopcReader
from pyproj import Transformer

from bentwing import ExportOptions, export, export_points
from bentwing.base.errors import InputError, UsageError
from bentwing.map import Crop, Polygon
from bentwing.map.read import read_points
from support.finished_runs import START_NS, finished_run, flight, on_earth

N = 20_000
STEP = 1e-4  # m, of coordinates in LAS


@pytest.fixture(scope="module")
def points():
    rng = np.random.default_rng(5)
    return rng.uniform([-20, -15, -1], [20, 15, 6], (N, 3))


@pytest.fixture(scope="module")
def local_run(points, tmp_path_factory):
    return finished_run(tmp_path_factory.mktemp("export") / "local", points)


@pytest.fixture(scope="module")
def placed_run(points, tmp_path_factory):
    return finished_run(tmp_path_factory.mktemp("export") / "placed", points, placed=on_earth())


def exported(run, path, *, tiles=None, map_format=None, trajectory_format=None, **options):
    return export(
        run,
        path,
        ExportOptions(**options),
        tiles=tiles,
        map_format=map_format,
        trajectory_format=trajectory_format,
    )


def ordered(points):
    return points[np.lexsort(np.round(points, 3).T)]


def test_a_map_as_it_is_has_all_points_and_attributes(local_run, tmp_path):
    exported(local_run, tmp_path / "out.laz")
    before, after = laspy.read(local_run / "map.laz"), laspy.read(tmp_path / "out.laz")
    for name in before.point_format.dimension_names:
        assert np.array_equal(before[name], after[name]), name
    assert before.vlrs.get("ExtraBytesVlr")[0].record_data_bytes() == after.vlrs.get("ExtraBytesVlr")[0].record_data_bytes()  # fmt: skip


def test_every_format_and_an_octree_have_the_same_points(local_run, points, tmp_path):
    for name, worst in [("a.copc.laz", STEP), ("a.las", STEP), ("a.ply", STEP), ("a.pcd", STEP)]:
        exported(local_run, tmp_path / name)
        found = read_points(tmp_path / name)
        assert np.abs(np.sort(found, axis=0) - np.sort(points, axis=0)).max() <= worst, name
    with CopcReader.open(tmp_path / "a.copc.laz") as reader:
        assert reader.header.point_count == N


def test_crops_and_spacing_act_together(local_run, points, tmp_path):
    crop = Crop(box=(-5, -5, -1, 9, 9, 3), area=Polygon.of([[-9, -9], [9, -9], [9, 9]]), within=4.0)
    done = exported(local_run, tmp_path / "out.las", crop=crop, spacing=0.5)
    x, y, _ = points.T
    inside = np.all((points >= [-5, -5, -1]) & (points <= [9, 9, 3]), axis=1) & (y < x)
    path = flight().positions[::5]
    inside &= np.linalg.norm(points[:, None] - path, axis=2).min(axis=1) < 4.0
    voxels = np.unique(np.floor(points[inside] / 0.5), axis=0)
    found = read_points(tmp_path / "out.las")
    assert len(np.unique(np.floor(found / 0.5 + 1e-6), axis=0)) == len(found) == done.n_points
    assert abs(len(found) - len(voxels)) <= 0.002 * len(voxels) + 1
    assert done.counts["map.cropped"] + done.counts["map.thinned"] + done.n_points == N
    assert "outside" in done.sentence()


def test_times_are_those_of_the_recording(local_run, tmp_path):
    exported(local_run, tmp_path / "out.las", crop=Crop(times=(5.0, 7.5)))
    times = laspy.read(tmp_path / "out.las").gps_time
    expected = np.linspace(0.0, 19.9, N)
    assert len(times) == np.count_nonzero((expected >= 5) & (expected <= 7.5))
    assert times.max() - times.min() == pytest.approx(2.5, abs=3e-3)


def test_coordinates_of_the_trajectory_come_back_from_a_map_on_the_earth(
    placed_run, points, tmp_path
):
    exported(placed_run, tmp_path / "out.las", local=True)
    # the rounding of the map, of the export, and of the polynomial that made the map
    assert np.abs(read_points(tmp_path / "out.las") - points).max() < 2 * STEP
    with laspy.open(tmp_path / "out.las") as file:
        assert file.header.parse_crs() is None


def test_another_projected_system_is_the_one_that_pyproj_finds(placed_run, tmp_path):
    exported(placed_run, tmp_path / "out.copc.laz", epsg=32633, crop=Crop(within=10.0))
    found = laspy.read(tmp_path / "out.copc.laz")
    assert found.header.parse_crs().to_epsg() == 32633
    exported(placed_run, tmp_path / "same.las", crop=Crop(within=10.0))
    x, y, _ = read_points(tmp_path / "same.las").T
    there = Transformer.from_crs("EPSG:32632", "EPSG:32633", always_xy=True).transform(x, y)
    in_time = np.argsort(found.gps_time)
    places = np.stack([found.x, found.y], axis=1)[in_time]
    assert np.abs(places - np.stack(there, axis=1)).max() < STEP


def test_a_distance_from_the_path_is_the_same_in_every_system(placed_run, points, tmp_path):
    counts = []
    for name, options in [("a", {}), ("b", {"local": True}), ("c", {"epsg": 32633})]:
        done = exported(placed_run, tmp_path / f"{name}.las", crop=Crop(within=3.0), **options)
        counts.append(done.n_points)
    path = flight().positions
    near = np.array([np.linalg.norm(path - point, axis=1).min() for point in points])
    # points that are rounded across the limit
    sure = [np.count_nonzero(near < 3.0 + side) for side in (-2e-3, 2e-3)]
    assert all(sure[0] <= count <= sure[1] for count in counts)


def test_an_area_in_degrees_cuts_a_map_on_the_earth(placed_run, points, tmp_path):
    """As geographic programs write it; and the same area as its own coordinates, with its system."""
    corners = np.array([[-6.0, -4, 0], [9, -4, 0], [9, 7, 0], [-6, 7, 0]])
    projected = on_earth().exact(corners)
    there = Transformer.from_crs("EPSG:32632", "EPSG:4326", always_xy=True)
    degrees = np.stack(there.transform(projected[:, 0], projected[:, 1]), axis=1)
    named = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::32632"}}
    expected = np.count_nonzero(
        np.all((points[:, :2] > [-6, -4]) & (points[:, :2] < [9, 7]), axis=1)
    )
    for name, ring, more in [("deg", degrees, {}), ("utm", projected[:, :2], {"crs": named})]:
        area = {"type": "Polygon", "coordinates": [ring.tolist()], **more}
        (tmp_path / f"{name}.geojson").write_text(json.dumps(area))
        done = exported(placed_run, tmp_path / f"{name}.las", polygon=tmp_path / f"{name}.geojson")
        assert abs(done.n_points - expected) <= 5


def test_small_numbers_are_metres_where_the_run_is_in_a_frame_of_its_own(
    local_run, points, tmp_path
):
    area = {"type": "Polygon", "coordinates": [[[0, 0], [5, 0], [5, 5], [0, 5]]]}
    (tmp_path / "a.geojson").write_text(json.dumps(area))
    done = exported(local_run, tmp_path / "a.las", polygon=tmp_path / "a.geojson")
    expected = np.all((points[:, :2] >= 0) & (points[:, :2] < 5), axis=1)
    assert abs(done.n_points - np.count_nonzero(expected)) <= 3
    area["crs"] = {"type": "name", "properties": {"name": "EPSG:25832"}}
    (tmp_path / "b.geojson").write_text(json.dumps(area))
    with pytest.raises(UsageError, match="frame of its own"):
        exported(local_run, tmp_path / "b.las", polygon=tmp_path / "b.geojson")


def test_the_points_come_as_arrays(local_run, points):
    chunks = list(export_points(local_run, ExportOptions(crop=Crop(heights=(0, 2)))))
    found = np.concatenate([chunk.points for chunk in chunks])
    assert np.abs(found[:, 2] - 1).max() <= 1
    assert len(found) == np.count_nonzero((np.round(points[:, 2], 4) >= 0) & (np.round(points[:, 2], 4) <= 2))  # fmt: skip
    assert {chunk.ring.dtype for chunk in chunks} == {np.dtype(np.uint16)}


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"crop": Crop(box=(100, 100, 0, 101, 101, 1))}, "reaches from"),
        ({"crop": Crop(times=(50, 60))}, "0.0 to 20.0 s"),
        ({"crop": Crop(box=(0, 0, 0, 1e-7, 1e-7, 1e-7))}, "no point of the map is left"),
        ({"epsg": 25832}, "where on the Earth"),
        ({"epsg": 25832, "local": True}, "give one"),
        ({"spacing": 0.0001}, "spacing"),
        ({"spacing": -1.0}, "spacing"),
        ({"spacing": float("nan")}, "spacing"),
        ({"tiles": 0}, "whole metres"),
        ({"trajectory_format": "kitti", "spacing": 0.1}, "trajectory"),
        ({"trajectory_format": "gpx"}, "tum, kitti"),
        ({"map_format": "obj"}, "laz, copc.laz"),
    ],
)
def test_what_cannot_be_is_refused_and_leaves_nothing(local_run, tmp_path, options, said):
    with pytest.raises(UsageError, match=said):
        exported(local_run, tmp_path / "out.laz", **options)
    assert list(tmp_path.iterdir()) == []


def test_a_name_that_says_no_format_and_one_that_is_taken_are_refused(local_run, tmp_path):
    with pytest.raises(UsageError, match=r"\.copc\.laz"):
        exported(local_run, tmp_path / "out.xyz")
    (tmp_path / "out.laz").touch()
    with pytest.raises(UsageError, match="exists already"):
        exported(local_run, tmp_path / "out.laz")
    with pytest.raises(UsageError, match="no folder"):
        exported(local_run, tmp_path / "none" / "out.laz")


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"spacing": 0.01}, "one point in 0.05 m only"),
        ({"keep_moving": True}, "cleaned otherwise"),
        ({"keep_mixed": True}, "cleaned otherwise"),
    ],
)
def test_what_the_map_does_not_have_needs_the_recording(points, tmp_path, options, reason):
    run = finished_run(tmp_path / "run", points, map_spacing=0.05)
    with pytest.raises(InputError, match=rf"{reason}.*gone\.bag"):
        exported(run, tmp_path / "out.laz", **options)


def test_a_map_that_was_changed_is_refused(local_run, tmp_path):
    run = shutil.copytree(local_run, tmp_path / "run")
    data = bytearray((run / "map.laz").read_bytes())
    data[-3000] ^= 1
    (run / "map.laz").write_bytes(data)
    with pytest.raises(InputError, match="SHA-256"):
        exported(run, tmp_path / "out.laz")


def test_a_run_that_is_not_complete_and_a_folder_of_something_else_are_refused(local_run, tmp_path):
    run = shutil.copytree(local_run, tmp_path / "run")
    record = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps({**record, "complete": False}))
    with pytest.raises(UsageError, match="not complete"):
        exported(run, tmp_path / "out.laz")
    with pytest.raises(UsageError, match="holds no bentwing run"):
        exported(tmp_path, tmp_path / "out.laz")
    parts = {"maps": [{"folder": "map_1"}, {"folder": "map_2"}]}
    (run / "run.json").write_text(json.dumps({**record, "merging": parts}))
    with pytest.raises(UsageError, match="map_1"):
        exported(run, tmp_path / "out.laz")


def test_other_programs_read_the_trajectory(local_run, tmp_path):
    """evo reads what KITTI, EuRoC and TUM have made the usual ones."""
    poses = flight()
    for name in ("a.tum", "a.kitti", "a.csv"):
        exported(local_run, tmp_path / name)
    tum = file_interface.read_tum_trajectory_file(tmp_path / "a.tum")
    euroc = file_interface.read_euroc_csv_trajectory(tmp_path / "a.csv")
    kitti = file_interface.read_kitti_poses_file(tmp_path / "a.kitti")
    for read in (tum, euroc):
        assert np.abs(read.positions_xyz - poses.positions).max() < 1e-6
        assert np.abs(read.timestamps - START_NS / 1e9 - poses.times).max() < 1e-6
        assert np.allclose(read.poses_se3, poses.T_map_imu, atol=1e-6)
    expected = np.linalg.inv(poses.T_map_imu[0]) @ poses.T_map_imu
    assert np.allclose(kitti.poses_se3, expected, atol=1e-6)


def test_a_path_on_the_earth_is_in_degrees_with_times(placed_run, local_run, tmp_path):
    exported(placed_run, tmp_path / "a.geojson")
    exported(placed_run, tmp_path / "a.kml")
    (feature,) = json.loads((tmp_path / "a.geojson").read_text())["features"]
    line = np.array(feature["geometry"]["coordinates"])
    place, shown = on_earth(), flight().positions[::10]
    expected = place.frame.to_geodetic(place.placement.to_level(shown))
    assert len(line) == len(feature["properties"]["coordTimes"]) == len(expected) + 1
    assert np.abs(line[:-1, :2] - expected[:, :2]).max() < 2e-9
    assert np.abs(line[:-1, 2] - expected[:, 2]).max() < 1e-3
    assert feature["properties"]["coordTimes"][0] == "2023-11-14T22:13:20.000Z"
    kml = (tmp_path / "a.kml").read_text()
    first = kml.partition("<coordinates>")[2].split()[0]
    assert np.allclose([float(v) for v in first.split(",")], line[0], atol=1e-9)
    with pytest.raises(UsageError, match="where on the Earth"):
        exported(local_run, tmp_path / "b.kml")
