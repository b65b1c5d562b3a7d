# SPDX-License-Identifier: MIT OR Apache-2.0
import json
import struct
import sys

import numpy as np
import pytest

from bentwing.base.errors import InputError, UsageError
from bentwing.base.voxels import voxel_keys
from bentwing.products import mesh_of, oriented_points, write_mesh
from bentwing.products.mesh_files import write_triangles
from support.known_points import write_run

THERE = np.array([640_500.0, 5_333_200.0, 200.0])
RADIUS = 2.0


@pytest.fixture
def o3d():
    # its shared libraries may be missing, too, which is an ImportError
    return pytest.importorskip("open3d", reason="Open3D is not installed", exc_type=ImportError)


def ball(n=40_000, seed=140):
    """Points on a sphere."""
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return RADIUS * directions / np.linalg.norm(directions, axis=1, keepdims=True)


@pytest.fixture(scope="module")
def inside(tmp_path_factory):
    """A run in the middle of a sphere, far from the zero of its coordinates."""
    way = np.linspace(-0.2, 0.2, 50)[:, None] * [1.0, 1.0, 0.5] + THERE
    return write_run(tmp_path_factory.mktemp("ball") / "run", ball() + THERE, way=way)


def two_sides(thickness, n=20_000, seed=141):
    """Both sides of an upright plate at x = 0, the first half of the points on that at negative x."""
    places = np.random.default_rng(seed).uniform(-1, 1, (n, 2))
    x = np.where(np.arange(n) < n // 2, -thickness / 2, thickness / 2)
    return np.column_stack([x, places])


def test_normals_point_to_the_sensor_and_across_the_surface(inside):
    found = oriented_points(inside)
    inwards = (THERE - found.points) / RADIUS
    cosines = (found.normals * inwards).sum(axis=1)
    assert len(found.points) > 10_000
    # 16 neighbours within 10 cm of a sphere of 2 m: 5 cm / 2 m where all are on one side
    assert cosines.min() > np.cos(0.1)
    assert np.allclose(np.linalg.norm(found.normals, axis=1), 1.0)
    assert len(np.unique(voxel_keys(found.points, found.spacing))) == len(found.points)


def test_sides_of_a_thin_plate_have_opposite_normals(tmp_path):
    # The sensor sees one side in the first half of the time and the other one in the second.
    way = np.array([[-2.0, 0, 0], [-2.0, 0, 0], [2.0, 0, 0], [2.0, 0, 0]])
    run = write_run(tmp_path / "run", two_sides(0.06), way=way)
    # the way crosses the plate between 3.3 and 6.7 s
    found = oriented_points(run, spacing=0.05)
    side = np.sign(found.points[:, 0])
    right = (found.normals[:, 0] * side) > np.cos(0.3)
    assert right.mean() > 0.98


def test_points_that_nobody_saw_have_no_normals(tmp_path):
    run = write_run(tmp_path / "run", ball(1000))
    with pytest.raises(InputError, match="nothing says from where"):
        oriented_points(run)


@pytest.mark.parametrize("spacing", [0.0, -1.0, np.nan, np.inf])
def test_a_spacing_that_cannot_be_used_is_refused(inside, spacing):
    with pytest.raises(UsageError, match="--spacing"):
        oriented_points(inside, spacing=spacing)


def test_without_open3d_a_mesh_says_how_to_install_it(inside, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "open3d", None)
    with pytest.raises(UsageError, match=r"run `pip install bentwing\[open3d\]`"):
        write_mesh(inside, tmp_path / "mesh.ply")
    assert not list(tmp_path.iterdir())


def test_a_missing_library_of_open3d_is_named(inside, tmp_path, monkeypatch):
    package = tmp_path / "packages"
    package.mkdir()
    (package / "open3d.py").write_text("raise ImportError('libusb-1.0.so.0: no such file')")
    monkeypatch.delitem(sys.modules, "open3d", raising=False)
    monkeypatch.syspath_prepend(package)
    with pytest.raises(UsageError, match=r"cannot be loaded \(libusb-1.0.so.0"):
        mesh_of(inside)


def test_a_mesh_is_the_surface_with_its_front_to_the_sensor(o3d, inside):  # noqa: ARG001
    mesh = mesh_of(inside)
    local = mesh.vertices - THERE
    # The sphere bends away from chords of 5 cm by 0.2 mm, and voxels flatten it as much.
    assert np.abs(np.linalg.norm(local, axis=1) - RADIUS).max() < 0.01
    assert mesh.area == pytest.approx(4 * np.pi * RADIUS**2, rel=0.01)
    a, b, c = np.moveaxis(local[mesh.triangles], 1, 0)
    assert (np.einsum("ni,ni->n", np.cross(b - a, c - a), -a) >= 0).mean() > 0.999
    lowest, highest = mesh.colours[[np.argmin(local[:, 2]), np.argmax(local[:, 2])]]
    assert lowest.tolist() == [0x3F, 0x48, 0x89]
    assert highest.tolist() == [0xFD, 0xE7, 0x25]


def test_a_surface_ends_where_the_points_do(o3d, tmp_path):  # noqa: ARG001
    points = ball()
    points = points[points[:, 2] < 0.5]
    way = np.zeros((5, 3))
    mesh = mesh_of(write_run(tmp_path / "run", points, way=way))
    assert mesh.vertices[:, 2].max() < 0.5 + 0.15
    # of a cap: 2 π r h
    assert mesh.area == pytest.approx(2 * np.pi * RADIUS * 2.5, rel=0.05)


def test_a_mesh_is_the_same_each_time(o3d, inside):  # noqa: ARG001
    assert mesh_of(inside, spacing=0.1) == mesh_of(inside, spacing=0.1)


def test_a_map_without_intensity_is_not_coloured_by_it(o3d, inside):  # noqa: ARG001
    with pytest.raises(InputError, match="no intensity"):
        mesh_of(inside, colour="intensity")


VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]])
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32)
COLOURS = np.array([[255, 0, 0], [0, 255, 0], [0, 0, 255], [10, 128, 250]], np.uint8)


def write(path):
    write_triangles(path, VERTICES, TRIANGLES, COLOURS, THERE)
    return path


def test_ply_has_coordinates_to_a_tenth_of_a_millimetre(tmp_path):
    header, body = write(tmp_path / "mesh.ply").read_bytes().split(b"end_header\n")
    assert b"element vertex 4\nproperty double x\n" in header
    assert b"element face 4\nproperty list uchar int vertex_indices" in header
    assert len(body) == 4 * 27 + 4 * 13
    assert struct.unpack("<3d3B", body[81:108]) == (640_500.0, 5_333_200.0, 203.0, 10, 128, 250)
    assert struct.unpack("<B3i", body[108:121]) == (3, 0, 2, 1)


def test_obj_has_all_digits_of_projected_coordinates(tmp_path):
    lines = write(tmp_path / "mesh.obj").read_text().splitlines()[1:]
    assert lines[1] == "v 640501.0000 5333200.0000 200.0000 0.0000 1.0000 0.0000"
    assert lines[4] == "f 1 3 2"
    assert len(lines) == 8


def test_glb_is_upright_and_says_where_its_zero_is(tmp_path):
    content = write(tmp_path / "mesh.glb").read_bytes()
    magic, version, length = struct.unpack("<4sII", content[:12])
    assert (magic, version, length) == (b"glTF", 2, len(content))
    n, kind = struct.unpack("<I4s", content[12:20])
    assert kind == b"JSON"
    scene = json.loads(content[20 : 20 + n])
    assert scene["nodes"][0]["extras"]["origin"] == THERE.tolist()
    n_binary, kind = struct.unpack("<I4s", content[20 + n : 28 + n])
    assert kind == b"BIN\0"
    assert n_binary == scene["buffers"][0]["byteLength"] == len(content) - 28 - n
    at = np.frombuffer(content, "<f4", 12, 28 + n).reshape(4, 3)
    assert at.tolist() == [[0, 0, 0], [1, 0, 0], [0, 0, -2], [0, 3, 0]]
    assert scene["accessors"][0]["max"] == [1, 3, 0]
    assert np.frombuffer(content, "<u4", offset=28 + n + 96).tolist() == TRIANGLES.ravel().tolist()
    assert (28 + n) % 4 == 0


@pytest.mark.parametrize("kind", ["ply", "obj", "glb"])
def test_open3d_reads_what_is_written(o3d, tmp_path, kind):
    mesh = o3d.io.read_triangle_mesh(str(write(tmp_path / f"mesh.{kind}")))
    turned = VERTICES[:, [0, 2, 1]] * [1, 1, -1]
    expected = turned if kind == "glb" else VERTICES + THERE
    corners = np.asarray(mesh.vertices)[np.asarray(mesh.triangles)]
    assert np.abs(corners - expected[TRIANGLES]).max() < 1e-4
    if kind != "glb":  # its reader takes shares of light for colours of screens
        colours = np.asarray(mesh.vertex_colors)[np.asarray(mesh.triangles)]
        assert np.abs(colours - COLOURS[TRIANGLES] / 255).max() < 1e-3
