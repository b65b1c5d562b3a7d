# SPDX-License-Identifier: MIT OR Apache-2.0
from dataclasses import replace

import laspy
import numpy as np
import pytest

from bentwing.base.geodesy import ProjectedSystem
from bentwing.base.voxels import cells_of
from bentwing.map.chunk import MapChunk
from bentwing.map.normals import moved, with_normals
from bentwing.map.read_chunks import MapFile
from bentwing.map.voxel_views import VoxelViews
from bentwing.map.writer import open_map

ORIGIN_NS = 1_700_000_000 * 10**9
FAR = np.array([640_500.0, 5_333_200.0, 200.0])


def seen_from(points, sensor):
    beams = points - sensor
    ranges = np.linalg.norm(beams, axis=1)
    return MapChunk(
        points,
        np.linspace(0.0, 10.0, len(points)),
        ranges.astype(np.float32),
        beams=(beams / ranges[:, None]).astype(np.float32),
    )


def ball(n=40_000, radius=2.0, seed=140):
    """Points on a sphere."""
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return radius * directions / np.linalg.norm(directions, axis=1, keepdims=True)


def tilted(rng, n=60_000, noise=0.005):
    """Points on a plane of 4 x 4 m with noise across it, and its normal upwards."""
    x, y = rng.uniform(-2, 2, (2, n))
    normal = np.array([-0.3, 0.2, 1.0]) / np.linalg.norm([-0.3, 0.2, 1.0])
    points = np.column_stack([x, y, 0.3 * x - 0.2 * y])
    return points + rng.normal(0, noise, (n, 1)) * normal, normal


def test_normals_point_to_the_lidar_and_across_the_surface(tmp_path):
    """Far from the zero of the coordinates as well, and whatever the chunks are."""
    whole = seen_from(ball() + FAR, FAR)
    parts = [whole.where(slice(first, first + 7000)) for first in range(0, 40_000, 7000)]
    found = list(with_normals(iter(parts), tmp_path))
    assert [len(chunk) for chunk in found] == [len(chunk) for chunk in parts]
    normals = np.concatenate([chunk.normals for chunk in found])
    cosines = np.einsum("ni,ni->n", normals, (FAR - whole.points) / 2.0)
    # a voxel of 5 cm and neighbours within 10 cm, of a sphere of 2 m
    assert cosines.min() > np.cos(0.12)
    assert np.allclose(np.linalg.norm(normals, axis=1), 1.0, atol=1e-6)
    assert not list(tmp_path.iterdir())


def test_normals_of_a_plane_are_as_exact_as_its_noise_allows(tmp_path):
    points, normal = tilted(np.random.default_rng(904))
    (found,) = with_normals(iter([seen_from(points, np.array([0.0, 0.0, 3.0]))]), tmp_path)
    angles = np.degrees(np.arccos(np.clip(found.normals @ normal, -1, 1)))
    # About 100 points in the 16 nearest voxels, which it crosses aslant, with 5 mm across and a spread of 4.5 cm:
    # 5 mm / 10 / 4.5 cm along each of two axes, of which the median is 1.18 times as large.
    assert np.median(angles) < 1.2 * np.degrees(1.18 * 0.005 / 10 / 0.045)


def test_both_sides_of_a_plate_have_normals_of_their_own(tmp_path):
    rng = np.random.default_rng(141)
    places = rng.uniform(-1, 1, (40_000, 2))
    left = np.arange(40_000) < 20_000
    points = np.column_stack([np.where(left, -0.03, 0.03), places])
    sides = [
        seen_from(points[left], np.array([-3.0, 0, 0])),
        seen_from(points[~left], np.array([3.0, 0, 0])),
    ]
    found = list(with_normals(iter(sides), tmp_path))
    assert (found[0].normals[:, 0] < -0.95).mean() > 0.98
    assert (found[1].normals[:, 0] > 0.95).mean() > 0.98


def test_single_points_and_those_nobody_saw_have_none(tmp_path):
    alone = seen_from(np.array([[5.0, 0, 0], [0, 5.0, 0]]), np.zeros(3))
    (found,) = with_normals(iter([alone]), tmp_path)
    assert np.isnan(found.normals).all()
    plane = seen_from(tilted(np.random.default_rng(3))[0], np.array([0.0, 0.0, 3.0]))
    unseen = replace(plane, beams=np.full_like(plane.beams, np.nan))
    (found,) = with_normals(iter([unseen]), tmp_path)
    assert np.isnan(found.normals).all()


def test_normals_turn_with_the_coordinates():
    """To the next UTM zone and back: grid north turns by some degrees."""
    here, there = ProjectedSystem.of_epsg(32632), ProjectedSystem.of_epsg(32633)
    middle = np.array([780_000.0, 5_333_200.0, 200.0])
    chunk = seen_from(ball(500) + middle, middle)
    inwards = -chunk.beams
    found = moved(replace(chunk, normals=inwards), lambda p: here.to(there, p))
    turned = np.degrees(np.arctan2(*found.normals[:, :2].T) - np.arctan2(*inwards[:, :2].T))
    turned = (turned + 180) % 360 - 180
    level = np.abs(inwards[:, 2]) < 0.5
    # the difference of two meridian convergences: 6 degrees by the sine of the latitude
    assert np.median(np.abs(turned[level])) == pytest.approx(6 * np.sin(np.radians(48.1)), abs=0.3)
    back = moved(found, lambda p: there.to(here, p))
    assert np.abs(back.normals - inwards).max() < 2e-3


def test_voxels_double_where_there_would_be_too_many():
    points = ball()
    gathered, once = VoxelViews(0.05, most=2000), VoxelViews(0.2)
    for part in np.array_split(points, 7):
        chunk = seen_from(part, np.zeros(3))
        gathered.add(chunk, -chunk.beams.astype(np.float64))
    views = gathered.result()
    assert gathered.edge == 0.2
    assert len(views.points) <= 2000
    whole = seen_from(points, np.zeros(3))
    once.add(whole, -whole.beams.astype(np.float64))
    assert np.allclose(once.result().points, views.points, atol=1e-9)
    assert np.allclose(once.result().towards, views.towards, atol=1e-9)
    assert len(np.unique(cells_of(points, 0.2), axis=0)) == len(views.points)


def with_further(n=300):
    rng = np.random.default_rng(5)
    chunk = seen_from(ball(n), np.zeros(3))
    attributes = np.zeros(n, [("reflectivity", "u1"), ("near_ir", "<u2"), ("signal", "<f4")])
    attributes["reflectivity"] = rng.integers(0, 256, n)
    attributes["near_ir"] = rng.integers(0, 65_536, n)
    attributes["signal"] = rng.normal(size=n)
    return replace(chunk, normals=-chunk.beams, attributes=attributes)


@pytest.mark.parametrize("kind", ["laz", "las", "copc.laz"])
def test_laspy_reads_normals_and_attributes(tmp_path, kind):
    chunk = with_further()
    with open_map(tmp_path / f"map.{kind}", kind, ORIGIN_NS) as writer:
        writer.write(chunk)
    las = laspy.read(tmp_path / f"map.{kind}")
    las.points = las.points[np.argsort(las.gps_time, kind="stable")]
    normals = np.stack([las[f"normal_{axis}"] for axis in "xyz"], axis=1)
    assert np.abs(normals - chunk.normals).max() <= 0.5 / 2048
    for name in chunk.attributes.dtype.names:
        assert las[name].dtype == chunk.attributes[name].dtype
        assert np.array_equal(las[name], chunk.attributes[name])
    (back,) = MapFile.open(tmp_path / f"map.{kind}").chunks(ORIGIN_NS)
    back = back.where(np.argsort(back.times, kind="stable"))
    assert np.abs(back.normals - chunk.normals).max() <= 0.5 / 2048
    assert back.attributes.dtype.names == chunk.attributes.dtype.names
    assert np.array_equal(back.attributes["near_ir"], chunk.attributes["near_ir"])


@pytest.mark.parametrize(
    ("kind", "names"), [("ply", "nx ny nz"), ("pcd", "normal_x normal_y normal_z")]
)
def test_rows_have_normals_and_attributes_under_the_names_of_the_format(tmp_path, kind, names):
    chunk = with_further()
    with open_map(tmp_path / f"map.{kind}", kind, ORIGIN_NS) as writer:
        writer.write(chunk)
    data = (tmp_path / f"map.{kind}").read_bytes()
    xyz = "<f8" if kind == "ply" else "<f4"
    row = np.dtype(
        [("xyz", xyz, 3), ("time", "<f8"), ("range", "<f4"), ("normal", "<f4", 3), ("reflectivity", "u1"),
         ("near_ir", "<u2"), ("signal", "<f4")]
    )  # fmt: skip
    table = np.frombuffer(data[-len(chunk) * row.itemsize :], row)
    assert np.array_equal(table["normal"], chunk.normals)
    assert np.array_equal(table["near_ir"], chunk.attributes["near_ir"])
    assert np.array_equal(table["signal"], chunk.attributes["signal"])
    header = data[: -len(chunk) * row.itemsize].decode()
    positions = [
        header.index(f" {name}") for name in [*names.split(), "reflectivity", "near_ir", "signal"]
    ]
    assert positions == sorted(positions)


@pytest.mark.parametrize("kind", ["laz", "ply"])
def test_chunks_of_runs_with_different_fields_share_a_file(tmp_path, kind):
    """As in a merged map; the first one decides, and what a later one lacks is zero."""
    first, second = with_further(), with_further()
    other = np.ones(len(second), [("ambient", "u1"), ("near_ir", "<u2")])
    with open_map(tmp_path / f"map.{kind}", kind, ORIGIN_NS) as writer:
        writer.write(first)
        writer.write(replace(second, attributes=other, times=second.times + 20.0))
        writer.write(replace(second, attributes=None, normals=None, times=second.times + 40.0))
    assert writer.n_points == 3 * len(first)
    if kind == "laz":
        las = laspy.read(tmp_path / "map.laz")
        assert "ambient" not in las.point_format.extra_dimension_names
        assert (las["near_ir"][300:600] == 1).all()
        assert not las["near_ir"][600:].any()


def test_a_structured_column_leaves_the_others_aligned(tmp_path):
    """Where chunks wait on the disk, whose rows the core reads as they are."""
    chunk = with_further(301)
    (found,) = with_normals(iter([chunk]), tmp_path)
    assert found.points.flags.aligned
    assert found.times.flags.aligned
    assert np.array_equal(found.attributes, chunk.attributes)
