# SPDX-License-Identifier: MIT OR Apache-2.0
import signal
import subprocess
import sys
import tracemalloc
from dataclasses import replace

import laspy
import numpy as np
import pytest

from bentwing.base.errors import EstimationError, InputError, UsageError
from bentwing.base.geodesy import ProjectedSystem
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.map.chunk import MapChunk
from bentwing.map.formats import FORMATS, MAP_FORMATS, load
from bentwing.map.read import read_points
from bentwing.map.writer import MapWriter, open_map

ORIGIN_NS = 1_700_000_000_123_456_789
READABLE = [name for name, entry in FORMATS.items() if entry.package is None]
WORST = {
    "laz": 5.1e-5,
    "copc.laz": 5.1e-5,
    "las": 5.1e-5,
    "ply": 0.0,
    "pcd": 4e-6,
}  # m, of points within 60 m


def chunk(n, seed=0, **without):
    rng = np.random.default_rng(seed)
    values = {
        "points": rng.uniform(-30, 30, (n, 3)),
        "times": 100 * seed + np.sort(rng.uniform(0, 60, n)),
        "ranges": rng.uniform(0, 30, n).astype(np.float32),
        "intensity": rng.uniform(0, 255, n).astype(np.float32),
        "ring": rng.integers(0, 16, n).astype(np.uint16),
    }
    return MapChunk(**{**values, **without})


def written(path, map_format, *chunks):
    with open_map(path, map_format, ORIGIN_NS) as writer:
        for part in chunks:
            writer.write(part)
    return path


@pytest.mark.parametrize("map_format", READABLE)
def test_points_come_back_from_every_format(tmp_path, map_format):
    parts = [chunk(1000, 0), chunk(1, 1), chunk(345, 2)]
    path = written(tmp_path / f"map.{map_format}", map_format, *parts)
    found, expected = read_points(path), np.concatenate([part.points for part in parts])
    if map_format == "copc.laz":  # which has an order of its own
        found, expected = (p[np.argsort(p[:, 0])] for p in (found, expected))
    assert np.abs(found - expected).max() <= WORST[map_format]


@pytest.mark.parametrize("map_format", READABLE)
def test_an_empty_map_is_a_valid_file(tmp_path, map_format):
    assert read_points(written(tmp_path / f"m.{map_format}", map_format)).shape == (0, 3)


def test_laz_carries_time_intensity_range_and_ring(tmp_path):
    part = chunk(500)
    las = laspy.read(written(tmp_path / "map.laz", "laz", part))
    assert str(las.header.version) == "1.4"
    assert las.header.point_format.id == 6
    assert las.header.global_encoding.gps_time_type == laspy.header.GpsTimeType.STANDARD
    assert np.array_equal(las.intensity, np.rint(part.intensity))
    assert np.array_equal(las["range"], part.ranges)
    assert np.array_equal(las["ring"], part.ring)
    # 2023-11-14 22:13:20 UTC is GPS 1,384,035,218; float64 steps by 60 ns there
    assert np.allclose(las.gps_time - 384_035_218.123456789, part.times, atol=6e-8, rtol=0)


@pytest.mark.parametrize("map_format", ["laz", "las", "copc.laz"])
def test_the_header_has_the_ends_of_all_that_is_written(tmp_path, map_format):
    parts = [chunk(200, seed, incidence=np.full(200, np.nan, np.float32)) for seed in range(2)]
    parts[1].incidence[:3] = np.radians([20.0, 10.0, 40.0])
    with laspy.open(written(tmp_path / f"map.{map_format}", map_format, *parts)) as file:
        header, las = file.header, file.read()
    for axis, column in enumerate("xyz"):
        assert (header.mins[axis], header.maxs[axis]) == (las[column].min(), las[column].max())
    assert header.number_of_points_by_return.tolist() == [400] + 14 * [0]
    (described,) = header.vlrs.get("ExtraBytesVlr")
    ends = {d.format_name(): (d.min, d.max) for d in described.extra_bytes_structs}
    assert ends["range"] == (las["range"].min(), las["range"].max())
    assert ends["ring"] == (0, 15)
    assert ends["incidence"] == (10.0, 40.0)


def test_las_without_intensity_and_ring_has_no_ring(tmp_path):
    las = laspy.read(written(tmp_path / "map.las", "las", chunk(5, intensity=None, ring=None)))
    assert list(las.point_format.extra_dimension_names) == ["range"]


def test_intensities_between_zero_and_one_use_the_whole_scale(tmp_path):
    part = chunk(3, intensity=np.array([0.0, 0.5, 1.0], np.float32))
    las = laspy.read(written(tmp_path / "map.las", "las", part))
    assert las.intensity.tolist() == [0, 32768, 65535]


def test_georeferenced_coordinates_keep_sub_millimetre_resolution(tmp_path):
    far = chunk(100, points=np.add(chunk(100).points, [512_345.6, 5_403_210.9, 230.0]))
    path = written(tmp_path / "map.las", "las", far)
    assert np.abs(read_points(path) - far.points).max() < 6e-5


def test_a_point_beyond_the_reach_of_las_is_a_failed_estimate(tmp_path):
    lost = chunk(2, points=np.array([[0.0, 0, 0], [1e9, 0, 0]]))
    with pytest.raises(EstimationError, match="diverged"):
        written(tmp_path / "map.las", "las", lost)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("kind", "size"), [("ply", 42), ("pcd", 30)])
def test_columns_are_little_endian_rows_of_the_declared_types(tmp_path, kind, size):
    part = chunk(10)
    data = written(tmp_path / f"map.{kind}", kind, part).read_bytes()
    xyz = "<f8" if kind == "ply" else "<f4"
    row = [("xyz", xyz, 3), ("t", "<f8"), ("range", "<f4"), ("intensity", "<f4"), ("ring", "<u2")]
    table = np.frombuffer(data[-10 * size :], np.dtype(row))
    assert np.array_equal(table["t"], part.times)
    assert np.array_equal(table["intensity"], part.intensity)
    assert np.array_equal(table["ring"], part.ring)
    assert f"{ORIGIN_NS} ns UTC".encode() in data
    assert (b"element vertex 10\n" if kind == "ply" else b"POINTS 10\n") in data


@pytest.mark.parametrize("map_format", READABLE)
def test_a_failure_leaves_the_earlier_map_and_no_rest(tmp_path, map_format):
    path = written(tmp_path / f"map.{map_format}", map_format, chunk(10))
    before = path.read_bytes()
    with pytest.raises((AttributeError, TypeError)):
        written(path, map_format, chunk(100), None)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("map_format", ["laz", "ply"])
def test_a_killed_process_leaves_nothing_under_the_final_name(tmp_path, map_format):
    script = f"""
import sys, numpy as np
from pathlib import Path
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map
with open_map(Path({str(tmp_path / "map")!r}), {map_format!r}, 0) as writer:
    while True:
        writer.write(MapChunk(np.ones((1000, 3)), np.ones(1000), np.ones(1000, np.float32)))
        print("written", flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE)
    process.stdout.readline()
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert not (tmp_path / "map").exists()


def test_an_unknown_format_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(UsageError, match="laz, las, ply, pcd, e57"):
        open_map(tmp_path / "map.obj", "obj", 0)


def test_e57_without_its_package_says_how_to_install_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pye57", None)
    with pytest.raises(UsageError, match=r"pip install bentwing\[e57\]"):
        open_map(tmp_path / "map.e57", "e57", 0)


def test_e57_holds_all_points_over_several_scans(tmp_path, monkeypatch):
    pye57 = pytest.importorskip("pye57", reason="pye57 is an optional package")
    monkeypatch.setattr("bentwing.map.write_e57.POINTS_PER_SCAN", 100)
    parts = [chunk(70, seed) for seed in range(5)]
    file = pye57.E57(str(written(tmp_path / "map.e57", "e57", *parts)))
    scans = [file.read_scan_raw(i) for i in range(file.scan_count)]
    x = np.concatenate([scan["cartesianX"] for scan in scans])
    assert np.allclose(x, np.concatenate([part.points[:, 0] for part in parts]), atol=1e-6)
    file.close()


def test_writing_costs_no_memory_that_grows_with_the_map(tmp_path):
    part = chunk(20_000)
    tracemalloc.start()
    with open_map(tmp_path / "map.ply", "ply", 0) as writer:
        for _ in range(50):
            writer.write(part)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 5 * 42 * len(part)


def test_gps_time_knows_the_leap_seconds():
    assert adjusted_gps_origin(315_964_800 * 10**9) == -1e9
    # GPS week 2086, second 0 is 2019-12-29 00:00:00 GPS, 18 s ahead of UTC
    assert adjusted_gps_origin((1_577_577_600 - 18) * 10**9) + 1e9 == 2086 * 604_800


FOREIGN = {
    "ascii.ply": b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
    b"property float z\nproperty uchar red\nend_header\n1 2 3 9\n4 5 6 9\n",
    "big.ply": b"ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty uchar red\n"
    b"property float x\nproperty float y\nproperty float z\nelement face 0\n"
    b"property list uchar int vertex_indices\nend_header\n"
    + np.array([(9, 1, 2, 3), (9, 4, 5, 6)], ">u1,>f4,>f4,>f4").tobytes(),
    "ascii.pcd": b"VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"
    b"POINTS 2\nDATA ascii\n1 2 3\n4 5 6\n",
    "padded.pcd": b"FIELDS x y z _\nSIZE 4 4 4 1\nTYPE F F F U\nCOUNT 1 1 1 4\nWIDTH 2\nHEIGHT 1\nPOINTS 2\n"
    b"DATA binary\n" + np.array([(1, 2, 3, 0), (4, 5, 6, 0)], "<f4,<f4,<f4,<u4").tobytes(),
}  # fmt: skip


@pytest.mark.parametrize("name", FOREIGN)
def test_files_of_other_programs_are_read(tmp_path, name):
    (tmp_path / name).write_bytes(FOREIGN[name])
    assert read_points(tmp_path / name).tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("map_format", READABLE)
@pytest.mark.parametrize("share", [0.0, 0.1, 0.5, 0.99])
def test_a_truncated_map_is_an_input_error(tmp_path, map_format, share):
    path = written(tmp_path / f"map.{map_format}", map_format, chunk(2000))
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    with pytest.raises(InputError, match=str(path.name)):
        read_points(path)


def test_a_map_of_an_unknown_kind_says_what_is_read(tmp_path):
    path = tmp_path / "map.docx"
    path.touch()
    with pytest.raises(InputError, match=r"\.laz, \.las, \.ply, \.pcd"):
        read_points(path)


@pytest.mark.parametrize("map_format", MAP_FORMATS)
def test_every_format_has_a_writer_and_a_reader(map_format):
    entry = FORMATS[map_format]
    assert issubclass(load(entry.writer), MapWriter)
    assert callable(load(entry.reader))


def full(n, seed=0, shift=(0.0, 0.0, 0.0)):
    rng = np.random.default_rng(seed)
    part = chunk(n, seed)
    return replace(
        part,
        points=part.points + shift,
        incidence=rng.uniform(0, 1.5, n).astype(np.float32),
        thickness=rng.uniform(0, 0.05, n).astype(np.float32),
        shift=rng.uniform(-0.03, 0.03, n).astype(np.float32),
        sigma=rng.uniform(0, 0.01, n).astype(np.float32),
        run_id=np.full(n, 3, np.uint16),
    )


UTM_SHIFT = (694_750.25, 5_177_603.5, 427.0)


@pytest.fixture(scope="module")
def utm():
    return ProjectedSystem.of_epsg(32632)


def test_laz_carries_all_that_is_known_of_a_point(tmp_path):
    part = full(500)
    las = laspy.read(written(tmp_path / "map.laz", "laz", part))
    names = ["range", "ring", "incidence", "thickness", "shift", "sigma", "run_id"]
    assert list(las.point_format.extra_dimension_names) == names
    assert np.abs(las["incidence"] - np.degrees(part.incidence)).max() <= 1 / 16 + 1e-4
    for name in ("thickness", "shift", "sigma"):
        assert np.abs(las[name] - getattr(part, name)).max() <= 1 / 16384 + 1e-7
    assert (las["run_id"] == 3).all()
    assert (las.point_source_id == 3).all()


def test_what_has_no_surface_is_not_a_number(tmp_path):
    part = replace(full(3), thickness=np.array([np.nan, 0.01, np.nan], np.float32))
    las = laspy.read(written(tmp_path / "map.laz", "laz", part))
    assert np.isnan(las["thickness"]).tolist() == [True, False, True]


@pytest.mark.parametrize("kind", ["ply", "pcd"])
def test_rows_have_incidence_in_degrees(tmp_path, kind):
    part = full(10)
    data = written(tmp_path / f"map.{kind}", kind, part).read_bytes()
    xyz = "<f8" if kind == "ply" else "<f4"
    row = np.dtype(
        [("xyz", xyz, 3), ("t", "<f8"), ("range", "<f4"), ("intensity", "<f4"), ("ring", "<u2"),
         ("incidence", "<f4"), ("thickness", "<f4"), ("shift", "<f4"), ("sigma", "<f4"),
         ("run_id", "<u2")]
    )  # fmt: skip
    table = np.frombuffer(data[-10 * row.itemsize :], row)
    assert np.allclose(table["incidence"], np.degrees(part.incidence))
    for name in ("thickness", "shift", "sigma"):
        assert np.array_equal(table[name], getattr(part, name))
    assert (table["run_id"] == 3).all()


@pytest.mark.parametrize("map_format", READABLE)
def test_a_map_on_the_earth_keeps_its_millimetres_in_every_format(tmp_path, map_format, utm):
    part = full(400, shift=UTM_SHIFT)
    path = tmp_path / f"map.{map_format}"
    with open_map(path, map_format, ORIGIN_NS, utm.wkt) as writer:
        writer.write(part)
    assert np.abs(read_points(path) - part.points).max() < 1e-4


def test_the_epsg_code_is_in_the_header(tmp_path, utm):
    with open_map(tmp_path / "map.laz", "laz", ORIGIN_NS, utm.wkt) as writer:
        writer.write(full(10, shift=UTM_SHIFT))
    with laspy.open(tmp_path / "map.laz") as file:
        assert file.header.global_encoding.wkt
        assert file.header.parse_crs().to_epsg() == 32632
    for kind in ("ply", "pcd"):
        with open_map(tmp_path / f"map.{kind}", kind, ORIGIN_NS, utm.wkt) as writer:
            writer.write(full(10, shift=UTM_SHIFT))
        head = (tmp_path / f"map.{kind}").read_bytes()[:2000]
        assert b'AUTHORITY["EPSG","32632"]' in head


def test_e57_on_the_earth_keeps_its_millimetres_and_its_system(tmp_path, utm):
    pye57 = pytest.importorskip("pye57", reason="pye57 is an optional package")
    part = full(400, shift=UTM_SHIFT)
    with open_map(tmp_path / "map.e57", "e57", ORIGIN_NS, utm.wkt) as writer:
        writer.write(part)
    assert np.abs(read_points(tmp_path / "map.e57") - part.points).max() < 1e-4
    file = pye57.E57(str(tmp_path / "map.e57"))
    assert '"32632"' in file.root["coordinateMetadata"].value()
    file.close()
