# SPDX-License-Identifier: MIT OR Apache-2.0
"""Places of points without times: all of them, or square tiles seen from above."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.places.part import MIN_POINTS, Part

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from numpy.typing import NDArray

    from bentwing.closing.places.settings import PlaceSettings

    Chunks = Callable[[], Iterable[NDArray[np.float64]]]

_COUNTED = 0.5  # m, edge of the cells that are counted to find the middle and the extent
_AT_ONCE = 40  # tiles that are held; of more, the points are gone through again


def tiled(chunks: Chunks, settings: PlaceSettings) -> Iterator[Part]:
    """One part if the points lie within two tiles, else one per tile; holds some tiles at a time.

    Of a tile with too many points it keeps every n-th, as `make_place` would.

    Parameters
    ----------
    chunks : goes through the points, (N, 3) m each, from the beginning whenever it is called
    """
    cells: dict[tuple[int, int], int] = {}
    for points in chunks():
        _add(cells, np.floor(points[:, :2] / _COUNTED).astype(np.int64))
    if not cells:
        return
    middle, reach = _middle_and_reach(cells)
    edge = None if (reach <= settings.tile).all() else settings.tile
    counts: dict[tuple[int, int], int] = {}
    for points in chunks():
        _add(counts, _numbers(points, middle, edge))
    tiles = sorted((t for t, n in counts.items() if n >= MIN_POINTS), key=lambda t: t[::-1])
    for first in range(0, len(tiles), _AT_ONCE):
        some = tiles[first : first + _AT_ONCE]
        steps = {tile: -(-counts[tile] // settings.max_points) for tile in some}
        for points in _gathered(chunks, middle, edge, steps):
            yield Part(points, None, None)


def _add(counts: dict[tuple[int, int], int], cells: NDArray[np.int64]) -> None:
    """Count points by their cells (N, 2)."""
    some, n = np.unique(cells, axis=0, return_counts=True)
    for x, y, more in zip(*some.T.tolist(), n.tolist(), strict=True):
        counts[x, y] = counts.get((x, y), 0) + more


def _middle_and_reach(
    cells: dict[tuple[int, int], int],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Median (2,) of the points, and within how much of it 95 % of them are in each direction, m."""
    at, n = np.array(list(cells)), np.array(list(cells.values()))
    xy = (at + 0.5) * _COUNTED
    middle = np.array([_quantile(xy[:, k], n, 0.5) for k in range(2)])
    reach = np.array([_quantile(np.abs(xy[:, k] - middle[k]), n, 0.95) for k in range(2)])
    return middle, reach


def _quantile(values: NDArray[np.float64], weights: NDArray[np.int64], share: float) -> float:
    order = np.argsort(values, kind="stable")
    reached = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(reached, share * reached[-1])])


def _numbers(
    points: NDArray[np.float64], middle: NDArray[np.float64], edge: float | None
) -> NDArray[np.int64]:
    """Tile (N, 2) of each point: one of all where there is no edge."""
    if edge is None:
        return np.zeros((len(points), 2), np.int64)
    return np.floor((points[:, :2] - middle) / edge + 0.5).astype(np.int64)


def _gathered(
    chunks: Chunks,
    middle: NDArray[np.float64],
    edge: float | None,
    steps: dict[tuple[int, int], int],
) -> list[NDArray[np.float64]]:
    """Every n-th point of some tiles, in the order of these."""
    held: dict[tuple[int, int], list[NDArray[np.float64]]] = {tile: [] for tile in steps}
    passed = dict.fromkeys(steps, 0)
    for points in chunks():
        numbers = _numbers(points, middle, edge)
        for tile in {(x, y) for x, y in np.unique(numbers, axis=0).tolist()} & steps.keys():
            rows = np.flatnonzero((numbers == tile).all(axis=1))
            held[tile].append(points[rows[-passed[tile] % steps[tile] :: steps[tile]]])
            passed[tile] += len(rows)
    return [np.concatenate(parts) for parts in held.values()]
