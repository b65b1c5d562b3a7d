# SPDX-License-Identifier: MIT OR Apache-2.0
"""COPC files are what laspy's own reader takes them for."""

from __future__ import annotations

import laspy
import lazrs
import numpy as np
import pytest
from laspy.copc import Bounds, CopcReader

from bentwing.base.geodesy import ProjectedSystem
from bentwing.map import octree
from bentwing.map.chunk import MapChunk
from bentwing.map.write_copc import CopcWriter
from bentwing.map.write_las import LasWriter

ORIGIN_NS = 1_700_000_000_123_456_789
N = 30_000


@pytest.fixture
def small_nodes(monkeypatch):
    """Nodes and blocks so small that a few points make a deep tree in several blocks."""
    monkeypatch.setattr(octree, "_FULL", 500)
    monkeypatch.setattr(octree, "_FEW", 10)
    monkeypatch.setattr(octree, "_BLOCK", 2000)


def walls(n=N, seed=0, offset=(0.0, 0.0, 0.0)):
    """Points of a floor and two walls, dense in one corner, as a flight that hovers leaves them."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(0, 20, (n, 3)) * rng.uniform(0, 1, (n, 1)) ** 3
    points[np.arange(n), rng.integers(0, 3, n)] = 0.0
    points += rng.normal(0, 0.005, points.shape) + offset
    for i in range(0, n, 7000):
        m = min(7000, n - i)
        yield MapChunk(
            points[i : i + m],
            np.sort(rng.uniform(i, i + m, m)) * 1e-3,
            rng.uniform(0, 30, m).astype(np.float32),
            rng.integers(0, 255, m).astype(np.float32),
            rng.integers(0, 16, m).astype(np.uint16),
        )


def written(path, chunks, writer=CopcWriter, crs_wkt=None):
    with writer(path, ORIGIN_NS, crs_wkt) as file:
        for chunk in chunks:
            file.write(chunk)
    return path


def places(points):
    return np.stack([points.x, points.y, points.z], axis=1)


def node_at(path, header, offset, n_bytes, n_points):
    """Coordinates of a node, decompressed from where the hierarchy says that it is."""
    with laspy.open(path) as plain:  # the other reader takes it out
        record = next(v for v in plain.header.vlrs if v.record_id == 22204).record_data
    rows = np.zeros(n_points, header.point_format.dtype())
    packed = np.frombuffer(path.read_bytes()[offset : offset + n_bytes], np.uint8)
    lazrs.decompress_points_with_chunk_table(
        packed, record, rows.view(np.uint8), [(n_points, n_bytes)]
    )
    steps = np.stack([rows[axis] for axis in "XYZ"], axis=1)
    return steps * header.scales + header.offsets


def rows_of(points):
    """All dimensions in an order that does not depend on that of the points."""
    order = np.lexsort((points.X, points.Y, points.Z, points.gps_time))
    names = points.point_format.dimension_names
    return {name: np.array(points[name])[order] for name in names}


@pytest.mark.parametrize("is_deep", [False, True])
def test_a_cloud_has_the_records_of_the_same_las(tmp_path, request, is_deep):
    if is_deep:
        request.getfixturevalue("small_nodes")
    las = laspy.read(written(tmp_path / "map.las", walls(), LasWriter))
    with CopcReader.open(written(tmp_path / "map.copc.laz", walls())) as reader:
        found, expected = rows_of(reader.query()), rows_of(las)
        assert found.keys() == expected.keys()
        for name, values in expected.items():
            assert np.array_equal(found[name], values), name
        assert np.allclose(reader.header.mins, las.header.mins, atol=1e-9)
        assert np.allclose(reader.header.maxs, las.header.maxs, atol=1e-9)
        assert reader.header.number_of_points_by_return[0] == N
    assert [path.name for path in tmp_path.iterdir() if path.suffix == ".partial"] == []


@pytest.mark.usefixtures("small_nodes")
def test_readers_that_know_no_octree_read_it_as_laz(tmp_path):
    path = written(tmp_path / "map.copc.laz", walls())
    plain = laspy.read(path)
    with CopcReader.open(path) as reader:
        expected = rows_of(reader.query())
    assert all(np.array_equal(values, expected[n]) for n, values in rows_of(plain).items())


@pytest.mark.usefixtures("small_nodes")
@pytest.mark.parametrize("seed", range(3))
def test_a_box_gives_the_points_in_it(tmp_path, seed):
    path = written(tmp_path / "map.copc.laz", walls(seed=seed))
    low, high = np.sort(np.random.default_rng(seed).uniform(0, 12, (2, 3)), axis=0)
    low[2], high[2] = -1.0, 3.0
    everything = places(laspy.read(path))
    inside = np.all((everything >= low) & (everything <= high), axis=1)
    with CopcReader.open(path) as reader:
        found = reader.query(bounds=Bounds(low, high))
    assert len(found) == np.count_nonzero(inside) > 0


@pytest.mark.usefixtures("small_nodes")
def test_every_point_lies_in_its_node_and_every_node_below_its_parent(tmp_path):
    path = written(tmp_path / "map.copc.laz", walls())
    with CopcReader.open(path) as reader:
        entries, info = reader.root_page.entries, reader.copc_info
        edge = 2 * info.halfsize
        assert max(key.level for key in entries) > 4
        for key, entry in entries.items():
            if key.level:
                parent = (key.level - 1, key.x // 2, key.y // 2, key.z // 2)
                assert any((k.level, k.x, k.y, k.z) == parent for k in entries)
            low = (
                info.center - info.halfsize + np.array([key.x, key.y, key.z]) * edge / 2**key.level
            )
            xyz = node_at(path, reader.header, entry.offset, entry.byte_size, entry.point_count)
            assert np.all(xyz >= low - 1e-7)
            assert np.all(xyz <= low + edge / 2**key.level + 1e-7)


@pytest.mark.usefixtures("small_nodes")
def test_a_level_has_one_point_in_a_cell_and_halves_its_spacing(tmp_path):
    path = written(tmp_path / "map.copc.laz", walls())
    with CopcReader.open(path) as reader:
        info = reader.copc_info
        assert info.spacing == pytest.approx(2 * info.halfsize / octree.GRID)
        low = info.center - info.halfsize
        for level in range(2):
            points = reader.query(level=level)
            cells = np.floor((places(points) - low) / (info.spacing / 2**level) + 1e-6).astype(int)
            _, counts = np.unique(cells, axis=0, return_counts=True)
            # but for what is too little to be a node of its own
            assert np.count_nonzero(counts > 1) < 0.1 * len(counts)
        coarse = reader.query(level=0)
    everything = places(laspy.read(path))
    reached = {tuple(c) for c in np.floor((places(coarse) - low) / info.spacing + 1e-6).astype(int)}
    asked = {tuple(c) for c in np.floor((everything - low) / info.spacing + 1e-6).astype(int)}
    assert len(asked - reached) < 0.02 * len(asked)


def test_the_times_of_a_cloud_are_in_its_description(tmp_path):
    path = written(tmp_path / "map.copc.laz", walls())
    times = laspy.read(path).gps_time
    with CopcReader.open(path) as reader:
        assert (reader.copc_info.gps_min, reader.copc_info.gps_max) == (times.min(), times.max())


def test_a_cloud_on_the_earth_says_its_system_and_keeps_its_resolution(tmp_path):
    system, offset = ProjectedSystem.of_epsg(32632), (512_345.6, 5_403_210.9, 230.0)
    path = written(tmp_path / "map.copc.laz", walls(offset=offset), crs_wkt=system.wkt)
    with CopcReader.open(path) as reader:
        assert reader.header.parse_crs().to_epsg() == 32632
        found = places(reader.query())
    expected = np.concatenate([chunk.points for chunk in walls(offset=offset)])
    assert np.abs(np.sort(found, axis=0) - np.sort(expected, axis=0)).max() < 6e-5


@pytest.mark.usefixtures("small_nodes")
def test_the_same_points_give_the_same_bytes(tmp_path):
    first = written(tmp_path / "a.copc.laz", walls()).read_bytes()
    assert written(tmp_path / "b.copc.laz", walls()).read_bytes() == first


@pytest.mark.parametrize("n", [0, 1])
def test_a_cloud_of_hardly_any_points_is_valid(tmp_path, n):
    path = written(tmp_path / "map.copc.laz", walls(n))
    with CopcReader.open(path) as reader:
        assert reader.header.point_count == n
        (entry,) = reader.root_page.entries.values()
        assert entry.point_count == n
        if n:
            assert len(reader.query()) == 1


@pytest.mark.usefixtures("small_nodes")
def test_points_at_one_place_and_one_far_away_are_kept(tmp_path):
    same = np.zeros((5000, 3))
    same[0] = [4000.0, -4000.0, 50.0]
    chunk = MapChunk(same, np.arange(5000.0), np.ones(5000, np.float32))
    with CopcReader.open(written(tmp_path / "map.copc.laz", [chunk])) as reader:
        found = reader.query()
    assert len(found) == 5000
    assert len(set(found.gps_time.tolist())) == 5000


def test_a_failure_leaves_nothing(tmp_path):
    with pytest.raises((AttributeError, TypeError)):
        written(tmp_path / "map.copc.laz", [*walls(100), None])
    assert list(tmp_path.iterdir()) == []
