# SPDX-License-Identifier: MIT OR Apache-2.0
"""Maps opened by programs that are not ours, where they are installed."""

import json
import shutil
import subprocess

import numpy as np
import pytest

from bentwing.base.geodesy import ProjectedSystem
from bentwing.base.gps_time import adjusted_gps_origin
from bentwing.map.chunk import MapChunk
from bentwing.map.writer import open_map

ORIGIN_NS = 1_700_000_000_000_000_000
UTM = 32632
SHIFT = np.array([694_750.25, 5_177_603.5, 427.0])
N = 60_000  # more than a chunk of LAZ


@pytest.fixture(scope="module")
def part():
    rng = np.random.default_rng(0)
    return MapChunk(
        rng.uniform(-30, 30, (N, 3)) + SHIFT,
        np.sort(rng.uniform(0, 60, N)),
        rng.uniform(0, 30, N).astype(np.float32),
        rng.uniform(0, 255, N).astype(np.float32),
        rng.integers(0, 16, N).astype(np.uint16),
        incidence=rng.uniform(0, 1.5, N).astype(np.float32),
        thickness=rng.uniform(0, 0.05, N).astype(np.float32),
        run_id=np.zeros(N, np.uint16),
    )


def write(path, part):
    system = ProjectedSystem.of_epsg(UTM)
    with open_map(path, path.name.partition(".")[2], ORIGIN_NS, system.wkt) as writer:
        writer.write(part)
    return path


@pytest.mark.skipif(shutil.which("pdal") is None, reason="PDAL is not installed")
@pytest.mark.parametrize("kind", ["laz", "copc.laz", "las"])
def test_pdal_agrees_on_count_times_system_and_every_point(tmp_path, part, kind):
    """As text with nine decimals: `pdal info` prints ten digits, too few for metres of UTM."""
    path = write(tmp_path / f"map.{kind}", part)

    def pdal(*arguments):
        return subprocess.run(["pdal", *arguments], check=True, capture_output=True).stdout

    summary = json.loads(pdal("info", "--summary", str(path)))["summary"]
    assert summary["num_points"] == N
    assert f'"{UTM}"' in summary["srs"]["wkt"]

    text = tmp_path / "map.txt"
    order = "--writers.text.order=X,Y,Z,GpsTime,range,incidence,thickness"
    pdal("translate", str(path), str(text), order, "--writers.text.precision=9",
         "--writers.text.keep_unspecified=false")  # fmt: skip
    read = np.loadtxt(text, delimiter=",", skiprows=1)
    read = read[np.argsort(read[:, 3], kind="stable")]  # COPC has an order of its own
    np.testing.assert_allclose(read[:, :3], part.points, rtol=0, atol=1e-4)
    times = adjusted_gps_origin(ORIGIN_NS) + part.times
    np.testing.assert_allclose(read[:, 3], times, rtol=0, atol=1e-6)
    np.testing.assert_allclose(read[:, 4], part.ranges, rtol=1e-6)
    np.testing.assert_allclose(read[:, 5], np.degrees(part.incidence), rtol=0, atol=0.1)
    np.testing.assert_allclose(read[:, 6], part.thickness, rtol=0, atol=5e-4)


@pytest.mark.skipif(shutil.which("pdal") is None, reason="PDAL is not installed")
def test_pdal_finds_the_points_in_a_box_of_an_octree(tmp_path, part):
    path, text = write(tmp_path / "map.copc.laz", part), tmp_path / "box.txt"
    low, high = SHIFT + np.array([[-5, -10, -30], [12, 0, 3]])
    bounds = str(tuple([float(a), float(b)] for a, b in zip(low, high, strict=True)))
    command = ["pdal", "translate", str(path), str(text), f"--readers.copc.bounds={bounds}"]
    subprocess.run(command, check=True, capture_output=True)
    inside = np.all((part.points >= low) & (part.points <= high), axis=1)
    assert len(np.loadtxt(text, delimiter=",", skiprows=1)) == np.count_nonzero(inside)


@pytest.mark.parametrize("kind", ["laz", "copc.laz"])
def test_laszip_agrees_on_every_point(tmp_path, part, kind):
    """The original library, instead of the one whose compressor we use."""
    pytest.importorskip("laszip", reason="laszip is not installed")
    import laspy

    path = write(tmp_path / f"map.{kind}", part)
    las = laspy.read(path, laz_backend=laspy.LazBackend.Laszip)
    assert len(las) == N
    las.points = las.points[np.argsort(las.gps_time, kind="stable")]
    assert np.abs(las.xyz - part.points).max() < 1e-4
    assert np.array_equal(las["range"], part.ranges)
    assert np.allclose(las.gps_time, adjusted_gps_origin(ORIGIN_NS) + part.times, atol=1e-7)


@pytest.mark.parametrize("kind", ["ply", "pcd"])
def test_open3d_agrees_on_count_and_bounds(tmp_path, part, kind):
    o3d = pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)
    path = write(tmp_path / f"map.{kind}", part)
    cloud = o3d.t.io.read_point_cloud(str(path))
    points = cloud.point.positions.numpy().astype(np.float64)
    # PCD is in single precision, relative to the offset that its header names
    offset = np.array([695_000.0, 5_178_000.0, 0.0]) if kind == "pcd" else np.zeros(3)
    assert np.abs(points + offset - part.points).max() < 1e-4
    assert np.allclose(cloud.point["time"].numpy().ravel(), part.times, atol=1e-6)


def test_libe57_agrees_on_count_and_bounds(tmp_path, part):
    pye57 = pytest.importorskip("pye57", reason="pye57 is an optional package")
    file = pye57.E57(str(write(tmp_path / "map.e57", part)))
    scan = file.read_scan(0, ignore_missing_fields=True)
    points = np.stack([scan[f"cartesian{axis}"] for axis in "XYZ"], axis=1)
    assert len(points) == N
    assert np.abs(points - part.points).max() < 1e-4
    file.close()
