# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map in square tiles, each a file of its own, with an index of them."""

from __future__ import annotations

import json
from contextlib import closing
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.array_spool import columns_of
from bentwing.base.atomic import write_text
from bentwing.base.buckets import Buckets
from bentwing.base.errors import UsageError
from bentwing.base.plain import plain
from bentwing.base.staged_folder import staged_folder
from bentwing.base.voxels import cells_of
from bentwing.map.chunk import MapChunk
from bentwing.map.epsg import geojson_system
from bentwing.map.writer import open_map

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.geodesy import ProjectedSystem
    from bentwing.base.progress import Progress

MOST_TILES = 10_000
INDEX_SUFFIX = ".geojson"
_ROWS = 2**32


def write_tiles(
    chunks: Generator[MapChunk, None, None],
    out: Path,
    edge: int,
    *,
    map_format: str,
    clock_origin_ns: int,
    system: ProjectedSystem | None,
    progress: Progress,
) -> int:
    """Write a folder of tiles NAME_x_y, where (x, y) is a tile's lower corner in m; return the points.

    The index NAME.geojson has the outline, file, number of points, heights and system of each tile.

    Parameters
    ----------
    chunks : of the whole map; they wait on the disk until all are known
    out : the folder, which gives the tiles its name
    edge : of the tiles, m
    system : of the coordinates; None for a frame without a name

    Raises
    ------
    UsageError
        If there are more than `MOST_TILES`, or nothing is left for any.
    """
    index = out.name + INDEX_SUFFIX
    features = []
    with staged_folder(out, index) as folder, Buckets(folder) as buckets, closing(chunks):
        for chunk in chunks:
            buckets.add(_keys_of(chunk, edge), columns_of(chunk))
        _require_few(buckets.counts, edge)
        n_points = sum(buckets.counts.values())
        with progress.stage("tiles", n_points, "points") as shown:
            for key, count in buckets.counts.items():
                x, y = (edge * cell for cell in _cell_of(key))
                path = folder / f"{out.name}_{x}_{y}.{map_format}"
                wkt = None if system is None else system.wkt
                low, high = np.inf, -np.inf
                with open_map(path, map_format, clock_origin_ns, wkt) as writer:
                    for tile in _chunks_of(buckets, key):
                        writer.write(tile)
                        low = min(low, float(tile.points[:, 2].min()))
                        high = max(high, float(tile.points[:, 2].max()))
                        shown.advance(len(tile))
                features.append(_feature(path.name, (x, y), edge, count, (low, high)))
        write_text(folder / index, json.dumps(plain(_index(out.name, system, features)), indent=1))
    return n_points


def _keys_of(chunk: MapChunk, edge: int) -> NDArray[np.int64]:
    """Return a number for each tile; those of voxels repeat within the reach of northings."""
    x, y, _ = cells_of(chunk.points, float(edge)).T
    keys: NDArray[np.int64] = x * _ROWS + (y + _ROWS // 2)
    return keys


def _cell_of(key: int) -> tuple[int, int]:
    """Return the cell along x and y of a tile."""
    x, y = divmod(key, _ROWS)
    return x, y - _ROWS // 2


def _chunks_of(buckets: Buckets, key: int) -> Iterator[MapChunk]:
    return (MapChunk(**columns) for columns in buckets.tables(key))


def _require_few(counts: dict[int, int], edge: int) -> None:
    if len(counts) > MOST_TILES:
        msg = (
            f"tiles of {edge} m are {len(counts):,}, more than {MOST_TILES:,}; give a larger edge, or "
            "crop"
        )
        raise UsageError(msg)
    if not counts:
        msg = "no point is left for any tile; crop less"
        raise UsageError(msg)


def _feature(
    name: str, corner: tuple[int, int], edge: int, count: int, heights: tuple[float, float]
) -> dict[str, Any]:
    (x, y), (low, high) = corner, (round(height, 4) for height in heights)
    ring = [[x, y], [x + edge, y], [x + edge, y + edge], [x, y + edge], [x, y]]
    return {
        "type": "Feature",
        "bbox": [x, y, low, x + edge, y + edge, high],
        "properties": {"file": name, "points": count, "lowest": low, "highest": high},
        "geometry": {"type": "Polygon", "coordinates": [ring]},
    }


def _index(
    name: str, system: ProjectedSystem | None, features: list[dict[str, Any]]
) -> dict[str, Any]:
    crs = geojson_system(None if system is None else system.epsg)
    return {"type": "FeatureCollection", "name": name, **crs, "features": features}
