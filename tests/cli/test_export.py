# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing export` as a user runs it on the run of a simulated flight."""

from __future__ import annotations

import json
import shutil

import laspy
import numpy as np
import pytest
from laspy.copc import CopcReader

from bentwing import Run
from bentwing.cli.main import run_command
from bentwing.map.read import read_points

SPACING = 0.05


@pytest.fixture(scope="module")
def run(office, tmp_path_factory):
    out = tmp_path_factory.mktemp("export") / "run"
    command = ["map", office / "recording.bag", "-p", office / "payload.yaml", "-o", out, "-q",
               "--map-spacing", SPACING]  # fmt: skip
    assert run_command([str(word) for word in command]) == 0
    return out


def test_a_run_becomes_an_octree(run, bentwing, tmp_path):
    said = bentwing("export", run, "-o", tmp_path / "site.copc.laz")
    assert said.code == 0, said.err
    n = len(read_points(run / "map.laz"))
    assert f"from map.laz, {n:,} points" in said.err
    assert said.out == f"{tmp_path}/site.copc.laz: {n:,} points\n"
    with CopcReader.open(tmp_path / "site.copc.laz") as reader:
        assert len(reader.query()) == n


def test_all_parts_of_a_command_act_together(run, bentwing, tmp_path):
    out = tmp_path / "part.laz"
    said = bentwing("export", run, "-o", out, "--box", "-3,-3,-1,3,3,1.5", "--heights", "-0.5,1",
                    "--times", "2,15", "--within", "4", "--spacing", "0.2", "-q")  # fmt: skip
    assert said.code == 0, said.err
    assert said.out + said.err == ""
    points = read_points(out)
    assert 0 < len(points) < 0.2 * len(read_points(run / "map.laz"))
    assert np.all(points >= np.array([-3, -3, -0.5]) - 1e-4)
    assert np.all(points <= np.array([3, 3, 1]) + 1e-4)
    path = Run.load(run).trajectory.positions
    nearest = [np.linalg.norm(path - point, axis=1).min() for point in points[::20]]
    assert max(nearest) <= 4.001


def test_a_finer_spacing_reads_the_recording_again(run, bentwing, tmp_path):
    """And finds what mapping with that spacing has written, but for the rounding of the trajectory's file."""
    said = bentwing("export", run, "-o", tmp_path / "fine.laz", "--spacing", "0")
    assert said.code == 0, said.err
    assert "from the recording, as its map has one point in 0.05 m only" in said.err
    record = json.loads((run / "run.json").read_text())
    counts = record["counts"]
    # all that was projected and not left out as moving or mixed
    expected = counts["map.points"] - counts["map.moving"] - counts["map.mixed_pixels"]
    found = laspy.read(tmp_path / "fine.laz")
    assert abs(len(found) - expected) < 1e-4 * expected
    thin = laspy.read(run / "map.laz")
    by_time = {round(t, 6): i for i, t in enumerate(np.asarray(found.gps_time).tolist())}
    rows = [by_time.get(round(t, 6)) for t in np.asarray(thin.gps_time).tolist()]
    known = [i for i, row in enumerate(rows) if row is not None]
    assert len(known) > 0.99 * len(rows)
    same = np.linalg.norm(found.xyz[[rows[i] for i in known]] - thin.xyz[known], axis=1)
    assert np.median(same) < 2e-4


def test_what_was_left_out_can_be_kept(run, bentwing, tmp_path):
    said = bentwing("export", run, "-o", tmp_path / "all.laz", "--keep-moving", "--keep-mixed",
                    "--spacing", "0")  # fmt: skip
    assert said.code == 0, said.err
    counts = json.loads((run / "run.json").read_text())["counts"]
    assert len(read_points(tmp_path / "all.laz")) == counts["map.points"]


def test_a_recording_that_is_gone_or_changed_is_missed_only_where_it_is_needed(
    run, bentwing, tmp_path
):
    moved = shutil.copytree(run, tmp_path / "run")
    record = json.loads((moved / "run.json").read_text())
    record["recordings"] = [str(tmp_path / "gone.bag")]
    (moved / "run.json").write_text(json.dumps(record))
    assert bentwing("export", moved, "-o", tmp_path / "a.laz", "--spacing", "0.1").code == 0
    said = bentwing("export", moved, "-o", tmp_path / "b.laz", "--spacing", "0.01")
    assert said.code == 3
    assert "gone.bag is gone" in said.err
    assert "one point in 0.05 m only" in said.err
    (tmp_path / "gone.bag").write_bytes(b"another")
    said = bentwing("export", moved, "-o", tmp_path / "b.laz", "--spacing", "0.01")
    assert said.code == 3
    assert "is not the recording" in said.err
    assert not (tmp_path / "b.laz").exists()


def test_a_run_without_a_map_is_exported_from_its_recording(office, bentwing, tmp_path):
    out = tmp_path / "run"
    said = bentwing("map", office / "recording.bag", "-p", office / "payload.yaml", "-o", out,
                    "--no-map", "-q")  # fmt: skip
    assert said.code == 0, said.err
    said = bentwing("export", out, "-o", tmp_path / "a.ply", "--spacing", "0.1")
    assert said.code == 0, said.err
    assert "made without a map" in said.err
    assert len(read_points(tmp_path / "a.ply")) > 1000


def test_normals_are_found_from_the_map_and_point_to_the_sensor(run, bentwing, tmp_path):
    said = bentwing("export", run, "-o", tmp_path / "normals.laz", "--normals")
    assert said.code == 0, said.err
    assert "from map.laz" in said.err
    las, way = laspy.read(tmp_path / "normals.laz"), Run.load(run).trajectory
    assert len(las) == len(read_points(run / "map.laz"))
    normals = np.stack([las[f"normal_{axis}"] for axis in "xyz"], axis=1)
    known = np.isfinite(normals[:, 0])
    assert known.mean() > 0.95
    times = las.gps_time - las.gps_time.min() + way.times[0]
    sensors = np.stack([np.interp(times, way.times, column) for column in way.positions.T], axis=1)
    towards = sensors - las.xyz
    facing = np.einsum("ni,ni->n", normals, towards) > 0
    assert facing[known].mean() > 0.99
    # an office is made of walls, floors and ceilings along three axes of its own
    up = np.abs(normals[known][:, 2])
    assert ((up > 0.99) | (up < 0.1)).mean() > 0.7


def test_tiles_and_their_index_make_a_folder(run, bentwing, tmp_path):
    said = bentwing("export", run, "-o", tmp_path / "site.laz", "--tiles", "5")
    assert said.code == 0, said.err
    index = json.loads((tmp_path / "site" / "site.geojson").read_text())
    n = sum(feature["properties"]["points"] for feature in index["features"])
    assert n == len(read_points(run / "map.laz"))


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("--box", "1,2,3"), 2, "6 numbers"),
        (("--box", "1,2,3,0,0,0"), 2, "lower limits first"),
        (("--heights", "low,high"), 2, "2 numbers"),
        (("--within", "-1"), 2, "above 0 m"),
        (("--polygon", "none.geojson"), 3, "no such file"),
        (("--times", "500,600"), 2, "the run has"),
        (("--epsg", "25832"), 2, "where on the Earth"),
        (("--map-format", "e57", "--normals"), 2, "no normals; write LAZ"),
        (("--attributes", "ambient"), 3, "no field ambient; attributes can be none"),
        (("--trajectory-format", "gpx"), 2, "gpx"),
    ],
)
def test_a_mistake_is_one_sentence_and_leaves_no_file(run, bentwing, tmp_path, words, code, said):
    done = bentwing("export", run, "-o", tmp_path / "out.laz", *words)
    assert done.code == code
    assert said in done.err
    assert len(done.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_an_empty_folder_is_no_run(bentwing, tmp_path):
    done = bentwing("export", tmp_path, "-o", tmp_path / "out.laz")
    assert done.code == 2
    assert "holds no bentwing run" in done.err


@pytest.mark.slow
def test_a_merged_map_is_exported_from_its_map_and_from_its_recordings(
    office, simulated, bentwing, tmp_path
):
    later, out = simulated("office", 22.0, flight_seed=9), tmp_path / "site"
    recordings = [folder / "recording.bag" for folder in (office, later)]
    said = bentwing("map", *recordings, "-p", office / "payload.yaml", "-o", out, "-q",
                    "--map-spacing", "0.05")  # fmt: skip
    assert said.code == 0, said.err
    assert bentwing("export", out, "-o", tmp_path / "a.laz").code == 0
    before, after = laspy.read(out / "map.laz"), laspy.read(tmp_path / "a.laz")
    assert np.array_equal(before["run_id"], after["run_id"])
    assert np.array_equal(before.xyz, after.xyz)
    said = bentwing("export", out, "-o", tmp_path / "b.laz", "--spacing", "0")
    assert said.code == 0, said.err
    fine = laspy.read(tmp_path / "b.laz")
    counts = json.loads((out / "run.json").read_text())["counts"]
    expected = counts["map.points"] - counts["map.moving"] - counts["map.mixed_pixels"]
    assert abs(len(fine) - expected) < 1e-4 * expected
    assert set(np.unique(fine["run_id"])) == {0, 1}
    assert abs(fine.gps_time.min() - before.gps_time.min()) < 0.1
    assert bentwing("export", out, "-o", tmp_path / "path.csv").code == 0
    names = sorted(path.name for path in tmp_path.glob("path_*.csv"))
    assert names == sorted(f"path_{folder.name}.csv" for folder in (office, later))
    said = bentwing("export", out, "-o", tmp_path / "site.mcap", "--spacing", "0.5")
    assert said.code == 0, said.err
    topics = {
        topic["name"]
        for topic in json.loads(bentwing("info", tmp_path / "site.mcap", "--json").out)["topics"]
    }
    assert {"/tf", "/map_points"} < topics
    assert len(topics) == 6


@pytest.mark.slow
def test_fields_of_a_real_recording_reach_the_map_and_its_exports(shared_data, bentwing, tmp_path):
    """And a run without a payload, of a lidar without an IMU, is read again from its recording."""
    said = bentwing("map", shared_data / "garage_hdl32.bag", "-o", tmp_path / "run", "--attributes", "time,ring",
                    "--no-refine", "--start", "2", "--duration", "2", "--map-spacing", "0.05", "-q")  # fmt: skip
    assert said.code == 0, said.err
    las = laspy.read(tmp_path / "run" / "map.laz")
    assert np.array_equal(las["sensor_ring"], las["ring"])
    assert 0.09 < las["sensor_time"].max() <= 0.1001
    assert (
        bentwing(
            "export", tmp_path / "run", "-o", tmp_path / "one.laz", "--attributes", "time"
        ).code
        == 0
    )
    names = [*laspy.read(tmp_path / "one.laz").point_format.extra_dimension_names]
    assert "sensor_time" in names
    assert "sensor_ring" not in names
    said = bentwing("export", tmp_path / "run", "-o", tmp_path / "all.laz", "--spacing", "0")
    assert "from the recording" in said.err
    fine = laspy.read(tmp_path / "all.laz")
    assert len(fine) > len(las)
    assert np.array_equal(fine["sensor_ring"], fine["ring"])
