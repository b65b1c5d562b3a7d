# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tiles divide a map without loss, and their index says where what is."""

from __future__ import annotations

import json

import laspy
import numpy as np
import pytest

from bentwing.base.errors import UsageError
from bentwing.base.geodesy import ProjectedSystem
from bentwing.base.progress import Progress
from bentwing.map import write_tiles as tiles_of
from bentwing.map.chunk import MapChunk
from bentwing.map.write_tiles import write_tiles

UTM = (694_750.25, 5_177_603.5, 427.0)  # y of tiles of 5 m is beyond what keys of voxels tell apart


def chunks(n=3000, shift=(0.0, 0.0, 0.0)):
    rng = np.random.default_rng(0)
    for i in range(0, n, 700):
        m = min(700, n - i)
        points = rng.uniform(-20, 20, (m, 3)) + shift
        yield MapChunk(points, np.arange(i, i + m, dtype=float), np.ones(m, np.float32))


def written(out, edge, source, system=None, **more):
    options = {"map_format": "laz", "clock_origin_ns": 0, "progress": Progress(), **more}
    return write_tiles(source, out, edge, system=system, **options)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), UTM])
def test_every_point_is_in_the_tile_that_its_name_and_the_index_say(tmp_path, shift):
    assert written(tmp_path / "site", 5, chunks(shift=shift)) == 3000
    index = json.loads((tmp_path / "site" / "site.geojson").read_text())
    files = {path.name for path in (tmp_path / "site").iterdir()}
    assert files == {"site.geojson", *(f["properties"]["file"] for f in index["features"])}
    assert "crs" not in index
    total = []
    for feature in index["features"]:
        said = feature["properties"]
        tile = laspy.read(tmp_path / "site" / said["file"])
        x, y = (int(word) for word in said["file"].removesuffix(".laz").split("_")[1:])
        assert feature["geometry"]["coordinates"][0][0] == [x, y]
        places = np.stack([tile.x, tile.y], axis=1)
        assert np.all(places >= np.array([x, y]) - 1e-4)
        assert np.all(places <= np.array([x + 5, y + 5]) + 1e-4)
        assert len(tile) == said["points"]
        assert said["lowest"] == pytest.approx(tile.z.min(), abs=2e-4)
        assert said["highest"] == pytest.approx(tile.z.max(), abs=2e-4)
        total.append(np.round(tile.gps_time + 1e9 + 315_964_800).astype(int))
    assert len(np.unique(np.concatenate(total))) == 3000


def test_the_index_of_a_map_on_the_earth_names_its_system(tmp_path):
    system = ProjectedSystem.of_epsg(32632)
    written(tmp_path / "site", 10, chunks(shift=UTM), system, map_format="copc.laz")
    index = json.loads((tmp_path / "site" / "site.geojson").read_text())
    assert index["crs"]["properties"]["name"] == "urn:ogc:def:crs:EPSG::32632"
    name = index["features"][0]["properties"]["file"]
    with laspy.open(tmp_path / "site" / name) as file:
        assert file.header.parse_crs().to_epsg() == 32632
    assert name.endswith(".copc.laz")


def test_too_many_tiles_and_none_at_all_are_refused_without_a_file(tmp_path, monkeypatch):
    monkeypatch.setattr(tiles_of, "MOST_TILES", 20)
    with pytest.raises(UsageError, match="larger edge"):
        written(tmp_path / "site", 1, chunks())
    with pytest.raises(UsageError, match="crop less"):
        written(tmp_path / "site", 1, chunks(0))
    assert list((tmp_path / "site").iterdir()) == []
