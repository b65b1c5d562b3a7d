# SPDX-License-Identifier: MIT OR Apache-2.0
import json
import sys

import laspy
import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.base.progress import Progress
from bentwing.base.trajectory import Trajectory
from bentwing.map.chunk import MapChunk
from bentwing.map.epsg import epsg_of_map
from bentwing.map.writer import open_map
from bentwing.report.view import view_run, write_frames, write_pictures
from bentwing.report.view.levels import Level, coarser_levels
from bentwing.report.view.pictures import read_pictured
from bentwing.run.folder import RunFolder


def box(n, seed=0):
    """Points on the floor and two walls of a box of 6 m by 4 m by 3 m, and their times."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0.0, 1.0, (n, 3)) * [6.0, 4.0, 3.0]
    points[np.arange(n), rng.integers(0, 3, n)] = 0.0
    return points, np.linspace(0.0, 9.0, n)


def test_a_level_keeps_one_point_per_voxel_and_never_too_many():
    level = Level(0.1, most=1000)
    points, times = box(60_000)
    for part in np.array_split(np.arange(len(points)), 7):
        level.add(points[part], times[part])
    held = level.result
    assert 200 < len(held.points) <= 1000
    assert held.edge > 0.1
    cells = np.floor(held.points.astype(float) / held.edge)
    assert len(np.unique(cells, axis=0)) == len(cells)
    assert (np.diff(held.times) >= 0).all()
    # nothing is lost: every point has one that stands for it
    kept = {tuple(c) for c in cells.astype(int)}
    rounded = points.astype(np.float32).astype(float)
    assert {tuple(c) for c in np.floor(rounded / held.edge).astype(int)} == kept


def test_coarser_levels_are_much_smaller():
    level = Level(0.05, most=10**6)
    level.add(*box(50_000))
    levels = coarser_levels(level.result, 2)
    sizes = [len(level.result.points), *(len(coarse.points) for coarse in levels)]
    assert sizes[0] > 5 * sizes[1] > 25 * sizes[2] > 0
    assert levels[1].edge == pytest.approx(16 * 0.05)


def test_an_empty_level_is_no_error():
    empty = Level(0.1, most=10).result
    assert len(empty.points) == 0
    assert [len(level.points) for level in coarser_levels(empty, 1)] == [0]


def test_without_rerun_it_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(UsageError, match=r"bentwing\[view\]"):
        view_run(tmp_path)


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    with pytest.raises(UsageError, match=r"run\.json"):
        view_run(tmp_path)


def run_folder(path, *, wkt=None, shift=(0.0, 0.0, 0.0)):
    """A run whose map is a box, in local or in projected coordinates."""
    points, times = box(40_000)
    way = np.column_stack([np.linspace(1, 5, 100), np.linspace(1, 3, 100), np.full(100, 1.5)])
    with RunFolder(path) as folder:
        written = folder.file("map.las")
        with open_map(written, "las", 10**18) as writer:
            writer.write(MapChunk(points + shift, times, np.ones(len(times), np.float32)))
        trajectory = Trajectory(
            np.linspace(0, 9, 100), way + shift, np.tile([0.0, 0, 0, 1], (100, 1))
        )
        trajectory.write_tum(folder.file("trajectory.txt"), 10**18)
        if wkt is not None:
            las = laspy.read(written)
            las.header.vlrs.append(laspy.vlrs.known.WktCoordinateSystemVlr(wkt))
            las.write(written)
    return path


UTM = 'PROJCRS["UTM 33N",BASEGEOGCRS["WGS 84",ID["EPSG",4326]],ID["EPSG",32633]]'


def test_pictures_of_a_local_run_have_no_place_on_earth(tmp_path):
    run = run_folder(tmp_path / "run")
    names = {path.name for path in write_pictures(run, tmp_path / "out", Progress())}
    assert names == {"top.png", "top_time.png", "section_along.png", "section_across.png"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == names


def test_a_georeferenced_run_has_a_geotiff_where_it_lies(tmp_path):
    corner = np.array([500_000.0, 5_400_000.0, 200.0])
    run = run_folder(tmp_path / "run", wkt=UTM, shift=corner)
    written = write_pictures(run, tmp_path / "out", Progress())
    tiff = next(path for path in written if path.name == "top.tif").read_bytes()
    numbers = np.frombuffer(tiff[-104:-32])  # in front of the keys: pixel size and corner
    easting, northing = numbers[6:8]
    assert easting == pytest.approx(corner[0], abs=0.3)
    assert northing == pytest.approx(corner[1] + 4.0, abs=0.3)


@pytest.mark.parametrize(
    ("wkt", "epsg"),
    [
        (UTM, 32633),
        ('COMPD_CS["x",PROJCS["y",AUTHORITY["EPSG","25832"]],VERT_CS["z",AUTHORITY["EPSG","5783"]]]', 25832),
        ('PROJCRS["no code"]', None),
        (None, None),
    ],
)  # fmt: skip
def test_the_code_of_a_map_is_that_of_its_horizontal_system(tmp_path, wkt, epsg):
    assert epsg_of_map(run_folder(tmp_path / "run", wkt=wkt) / "map.las") == epsg


def test_frames_show_the_map_grow(tmp_path):
    run = run_folder(tmp_path / "run")
    frames = write_frames(run, tmp_path / "out", 3, Progress())
    assert [path.name for path in frames] == [f"frame_000{k}.png" for k in (1, 2, 3)]
    assert frames[0].stat().st_size < frames[2].stat().st_size


def test_pictures_of_a_merged_map_have_the_ways_of_all_its_runs(tmp_path):
    run = run_folder(tmp_path / "site")
    record = json.loads((run / "run.json").read_text())
    for name in ("a", "b"):
        (run / f"trajectory_{name}.txt").write_text((run / "trajectory.txt").read_text())
    (run / "trajectory.txt").unlink()
    record["runs"] = [{"name": n, "trajectory": f"trajectory_{n}.txt"} for n in ("a", "b")]
    (run / "run.json").write_text(json.dumps(record))
    written = write_pictures(run, tmp_path / "out", Progress())
    assert {path.name for path in written} >= {"top.png", "section_across.png"}
    assert len(read_pictured(run).trajectory.times) == 200
