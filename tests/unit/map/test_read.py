# SPDX-License-Identifier: MIT OR Apache-2.0
"""Reading maps part by part, their times, scans of stations, and meshes."""

import struct

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bentwing.base.errors import InputError, UsageError
from bentwing.map import read_rows
from bentwing.map.chunk import MapChunk
from bentwing.map.lzf import decompress_lzf
from bentwing.map.read import read_parts, read_points
from bentwing.map.read_mesh import read_mesh
from bentwing.map.writer import open_map

MESH = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 4\nproperty double x\nproperty double y\n"
    b"property double z\nelement face 2\nproperty list uchar uint vertex_indices\nend_header\n"
)


def mesh_bytes(corners=((0, 1, 2), (0, 2, 3))):
    vertices = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], "<f8")
    faces = np.zeros(len(corners), [("n", "u1"), ("corners", "<u4", 3)])
    faces["n"], faces["corners"] = 3, corners
    return MESH + vertices.tobytes() + faces.tobytes()


def written(path, n=2_500):
    rng = np.random.default_rng(0)
    chunk = MapChunk(
        rng.uniform(-9, 9, (n, 3)), np.sort(rng.uniform(0, 60, n)), np.ones(n, np.float32)
    )
    with open_map(path, path.suffix[1:], 10**18) as writer:
        writer.write(chunk)
    return chunk


@pytest.mark.parametrize("kind", ["laz", "las", "ply", "pcd"])
def test_parts_hold_all_points_with_their_times(tmp_path, monkeypatch, kind):
    monkeypatch.setattr(read_rows, "PART", 1_000)
    monkeypatch.setattr("bentwing.map.read_las.PART", 1_000)
    path = tmp_path / f"map.{kind}"
    chunk = written(path)
    parts = list(read_parts(path))
    assert [len(part.points) for part in parts] == [1_000, 1_000, 500]
    times = np.concatenate([part.times for part in parts])
    assert np.allclose(times - times[0], chunk.times - chunk.times[0], atol=1e-6)
    assert np.allclose(np.concatenate([part.points for part in parts]), chunk.points, atol=1e-4)


def test_text_is_read_in_parts_and_without_times_where_it_has_none(tmp_path, monkeypatch):
    monkeypatch.setattr(read_rows, "PART", 2)
    path = tmp_path / "map.ply"
    rows = "".join(f"{i} {i} {i}\n" for i in range(5))
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n"
        f"property float z\nend_header\n{rows}"
    )
    parts = list(read_parts(path))
    assert [len(part.points) for part in parts] == [2, 2, 1]
    assert all(part.times is None for part in parts)


def test_e57_scans_are_put_in_their_places(tmp_path):
    pye57 = pytest.importorskip("pye57", reason="pye57 is not installed")
    points = np.random.default_rng(0).uniform(-5, 5, (100, 3))
    columns = {f"cartesian{axis}": points[:, i].copy() for i, axis in enumerate("XYZ")}
    file = pye57.E57(str(tmp_path / "scan.e57"), mode="w")
    for shift in (0.0, 100.0):
        quarter = np.array([np.sqrt(0.5), 0, 0, np.sqrt(0.5)])  # w first, about z
        file.write_scan_raw(columns, rotation=quarter, translation=np.array([shift, 0, 0]))
    file.close()
    found = read_points(tmp_path / "scan.e57")
    turned = points[:, [1, 0, 2]] * [-1, 1, 1]
    assert np.allclose(found, np.vstack([turned, np.add(turned, [100, 0, 0])]))


def test_e57_without_its_package_says_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pye57", None)
    (tmp_path / "scan.e57").write_bytes(b"ASTM-E57")
    with pytest.raises(UsageError, match="pip install"):
        read_points(tmp_path / "scan.e57")


def test_a_mesh_is_read_and_a_cloud_is_none(tmp_path):
    path = tmp_path / "scene.ply"
    path.write_bytes(mesh_bytes())
    mesh = read_mesh(path)
    assert mesh.vertices.shape == (4, 3)
    assert mesh.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    written(tmp_path / "cloud.ply", 10)
    assert read_mesh(tmp_path / "cloud.ply") is None
    assert read_mesh(tmp_path / "cloud.laz") is None


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (mesh_bytes(corners=((0, 1, 7), (0, 1, 2))), "vertices that are not there"),
        (mesh_bytes()[:-5], "2 rows are announced"),
        (mesh_bytes().replace(b"binary_little_endian", b"ascii"), "binary little-endian"),
        (mesh_bytes().replace(b"uint vertex", b"long vertex"), "not readable"),
    ],
)
def test_a_damaged_mesh_is_an_input_error(tmp_path, content, says):
    (tmp_path / "scene.ply").write_bytes(content)
    with pytest.raises(InputError, match=says):
        read_mesh(tmp_path / "scene.ply")


@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(
    st.integers(0, len(mesh_bytes()) - 1), st.integers(0, 255), st.integers(0, len(mesh_bytes()))
)
def test_a_mesh_with_a_changed_byte_is_read_or_an_input_error(tmp_path, at, byte, cut):
    content = bytearray(mesh_bytes())
    content[at] = byte
    (tmp_path / "scene.ply").write_bytes(bytes(content[: cut or None]))
    try:
        mesh = read_mesh(tmp_path / "scene.ply")
    except InputError:
        return
    assert mesh is None or mesh.triangles.max() < len(mesh.vertices)


def test_repetitions_of_compressed_data_may_overlap_themselves():
    # three bytes as they are, then nine from two back: abc + bcbcbcbcb
    packed = bytes([2]) + b"abc" + bytes([7 << 5, 0, 1])
    assert b"".join(decompress_lzf(packed, 12)) == b"abcbcbcbcbcb"


def test_repetitions_reach_back_over_the_ends_of_blocks():
    rng = np.random.default_rng(3)
    packed, expected = bytearray(), bytearray()
    while len(expected) < 3_000_000:
        literal = rng.bytes(int(rng.integers(1, 33)))
        packed += bytes([len(literal) - 1]) + literal
        expected += literal
        back, length = int(rng.integers(1, min(len(expected), 8192) + 1)), int(rng.integers(9, 265))
        packed += bytes([(7 << 5) | ((back - 1) >> 8), length - 9, (back - 1) & 255])
        for _ in range(length):
            expected.append(expected[-back])
    assert b"".join(decompress_lzf(bytes(packed), len(expected))) == expected


@pytest.mark.parametrize("packed", [b"\x02abc\x20\x05", b"\x02abc", b"\x02ab"])
def test_damaged_compressed_data_are_refused(packed):
    with pytest.raises(ValueError, match="damaged"):
        b"".join(decompress_lzf(packed, 12))


def test_compressed_pcd_files_are_read_and_truncated_ones_refused(tmp_path):
    points = np.arange(30, dtype="<f4").reshape(10, 3)
    columns = np.ascontiguousarray(points.T).tobytes()
    # each 20 bytes as they are
    packed = b"".join(bytes([19]) + columns[k : k + 20] for k in range(0, 120, 20))
    header = (
        "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 10\nHEIGHT 1\n"
        "POINTS 10\nDATA binary_compressed\n"
    )
    content = header.encode() + np.array([len(packed), 120], "<u4").tobytes() + packed
    path = tmp_path / "map.pcd"
    path.write_bytes(content)
    np.testing.assert_array_equal(read_points(path), points)
    path.write_bytes(content[:-5])
    with pytest.raises(InputError):
        read_points(path)


HUGE = 2**32 - 1


@pytest.mark.parametrize(
    ("kind", "at", "form", "value"),
    [
        ("las", 100, "<I", HUGE),  # records
        ("laz", 100, "<I", HUGE),
        ("las", 243, "<I", HUGE),  # extended records
        ("las", 96, "<I", HUGE),  # where the points begin
        ("las", 247, "<Q", 2**40),  # points
        ("las", 94, "<H", 10),  # size of the header
    ],
)
def test_a_las_file_that_announces_more_than_it_holds_is_refused_at_once(
    tmp_path, kind, at, form, value
):
    path = tmp_path / f"map.{kind}"
    written(path)
    content = bytearray(path.read_bytes())
    struct.pack_into(form, content, at, value)
    if at == 243:
        struct.pack_into("<Q", content, 235, 375)
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot hold"):
        read_points(path)


@pytest.mark.parametrize("missing", [0, 1, 700, 2_000])
def test_a_laz_file_that_lacks_a_byte_is_an_input_error(tmp_path, missing):
    path = tmp_path / "map.laz"
    written(path)
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 96)
    del content[start + 8 + missing]
    path.write_bytes(content)
    with pytest.raises(InputError):
        read_points(path)


def test_a_laz_file_with_a_huge_table_of_chunks_is_refused_at_once(tmp_path):
    path = tmp_path / "map.laz"
    written(path)
    content = bytearray(path.read_bytes())
    (start,) = struct.unpack_from("<I", content, 96)
    (table,) = struct.unpack_from("<q", content, start)
    struct.pack_into("<I", content, table + 4, HUGE)
    path.write_bytes(content)
    with pytest.raises(InputError, match="a table of chunks that the file cannot hold"):
        read_points(path)


def test_a_pcd_file_with_a_huge_number_of_columns_is_refused_at_once(tmp_path):
    path = tmp_path / "map.pcd"
    path.write_text(
        "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 2000000000\nPOINTS 1\nDATA ascii\n0 0 0\n"
    )
    with pytest.raises(InputError, match="announces 2000000002 columns"):
        read_points(path)


def test_an_error_of_a_library_is_one_line(tmp_path, monkeypatch):
    def broken(_path):
        msg = "bad packet\n context: 0\n source: packet.cpp"
        raise ValueError(msg)
        yield

    monkeypatch.setattr("bentwing.map.read_las.las_points", broken)
    path = tmp_path / "map.las"
    path.touch()
    with pytest.raises(InputError) as refused:
        read_points(path)
    assert str(refused.value) == f"{path}: not readable as LAS (bad packet)"
