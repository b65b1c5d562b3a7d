# SPDX-License-Identifier: MIT OR Apache-2.0
"""An octree whose nodes hold samples of the points below them, made of any number of points.

A node of level l is a cube of 2^-l of the root's edge and keeps one point in each cell of a grid of
`GRID`³; the rest goes on to its eight children. Points that came to the disk are first sorted into blocks
that fit into memory: the cells of a grid lie in blocks as whole ones, or blocks in them, so that each block
finds its own samples.

References: Schütz, Ohrhallinger and Wimmer 2020, Fast out-of-core octree generation for massive point clouds.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base.buckets import Buckets

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path

    from numpy.typing import NDArray

    Rows = NDArray[np.void]

_GRID_LEVELS = 7
GRID = 2**_GRID_LEVELS
"""Cells of a node along an edge, of which each gives it one point."""
_FULL = 2**15  # points; a node with fewer has no children
_FEW = 2**8  # points; children with fewer are not worth a node
_BLOCK = 1_500_000  # points that are in memory at once
_STEPS_OF_BLOCKS = 5  # levels that blocks are sought below
_FINEST = 16  # steps of coordinates in the finest cells, at least
_DEEPEST = 20  # halvings, of which the codes have three bits each
_COLUMN = "rows"


class Node(NamedTuple):
    """A node of the tree: level, and cell along x, y and z."""

    level: int
    x: int
    y: int
    z: int


@dataclass(frozen=True, slots=True)
class Cube:
    """The root node on the grid of whole steps that coordinates are stored in.

    Attributes
    ----------
    low : (3,) int64, its corner
    unit : steps along an edge of the finest cells
    depth : halvings from the root to them
    """

    low: NDArray[np.int64]
    unit: int
    depth: int

    @classmethod
    def around(cls, low: NDArray[np.int64], high: NDArray[np.int64]) -> Cube:
        """Return the cube for coordinates from `low` to `high` (3,)."""
        extent: int = int((high - low).max()) + 1
        depth = (extent // _FINEST).bit_length() - 1
        depth = min(max(depth, _GRID_LEVELS), _DEEPEST)
        unit = -(-extent // 2**depth)
        return cls(np.asarray(low, np.int64), unit, depth)

    @property
    def edge(self) -> int:
        """Steps along an edge."""
        return self.unit << self.depth

    @property
    def last_level(self) -> int:
        """Level of the nodes that have no children."""
        return self.depth - _GRID_LEVELS

    def codes(self, rows: Rows) -> NDArray[np.int64]:
        """Return the finest cells (N,) of records with X, Y and Z, as bits x y z x y z ...

        The code of a cell l levels up is the same without its last 3 l bits.
        """
        codes = np.zeros(len(rows), np.int64)
        for axis, name in enumerate("XYZ"):
            cells = (rows[name].astype(np.int64) - self.low[axis]) // self.unit
            codes |= _spread(cells) << (2 - axis)
        return codes

    def node(self, level: int, code: int) -> Node:
        """Return the node of a level that has this code."""
        cells = [0, 0, 0]
        for bit in range(level):
            for axis in range(3):
                cells[axis] |= (code >> (3 * bit + 2 - axis) & 1) << bit
        return Node(level, *cells)


def _spread(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """Put two empty bits between the 21 lower bits of each number."""
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cells = (cells | cells << shift) & mask
    return cells


def nodes_of(
    parts: Callable[[], Iterator[Rows]], n_points: int, cube: Cube, folder: Path
) -> Iterator[tuple[Node, Rows]]:
    """Yield the nodes with their records, each once.

    Parameters
    ----------
    parts : yields all records, with X, Y and Z in steps, as often as it is called
    n_points : in all parts
    folder : of temporary files, as large as the records
    """
    taken: set[tuple[int, int]] = set()
    with Buckets(folder) as coarse:
        for block in _blocks(parts, n_points, cube, folder, (0, 0)):
            yield from _nodes_of_block(block, cube, taken, coarse)
        for key in coarse.counts:
            level = (key.bit_length() - 1) // 3
            rows = np.concatenate([*_rows_of(coarse, key)])
            yield cube.node(level, key & ~(1 << 3 * level)), rows


def _rows_of(buckets: Buckets, key: int) -> Iterator[Rows]:
    return (table[_COLUMN] for table in buckets.tables(key))


class _Block(NamedTuple):
    """All records in a node, by its level and code."""

    level: int
    code: int
    rows: Rows


def _blocks(
    parts: Callable[[], Iterator[Rows]],
    n_points: int,
    cube: Cube,
    folder: Path,
    node: tuple[int, int],
) -> Iterator[_Block]:
    """Yield the largest nodes below one that fit into memory, in the order of their codes."""
    level, code = node
    if n_points <= _BLOCK or level >= cube.last_level:
        yield _Block(level, code, np.concatenate([*parts()]))
        return
    below = min(level + _STEPS_OF_BLOCKS, cube.last_level)
    finest, shift = 3 * (below - level), 3 * (cube.depth - below)
    first = code << finest
    counts = np.zeros(1 << finest, np.int64)
    for rows in parts():
        counts += np.bincount((cube.codes(rows) >> shift) - first, minlength=len(counts))
    levels, numbers = _division(counts, below - level)
    with Buckets(folder) as buckets:
        for rows in parts():
            buckets.add(numbers[(cube.codes(rows) >> shift) - first], {_COLUMN: rows})
        for number, count in buckets.counts.items():
            own = level + int(levels[number])
            yield from _blocks(
                partial(_rows_of, buckets, number),
                count,
                cube,
                folder,
                (own, (first + number) >> 3 * (below - own)),
            )


def _division(counts: NDArray[np.int64], depth: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Divide a node until its parts are small enough, or are as small as is counted.

    Parameters
    ----------
    counts : (8^depth,) points in each cell, in the order of the codes

    Returns
    -------
    levels : (8^depth,) of the part that a cell is in, below the node
    numbers : (8^depth,) the first cell of that part
    """
    levels = np.full(len(counts), depth, np.int64)
    for level in range(depth - 1, -1, -1):
        width = 8 ** (depth - level)
        fits = counts.reshape(-1, width).sum(axis=1) <= _BLOCK
        levels[np.repeat(fits, width)] = level
    cells = np.arange(len(counts))
    return levels, cells >> 3 * (depth - levels) << 3 * (depth - levels)


def _nodes_of_block(
    block: _Block, cube: Cube, taken: set[tuple[int, int]], coarse: Buckets
) -> Iterator[tuple[Node, Rows]]:
    codes = cube.codes(block.rows)
    order = np.argsort(codes, kind="stable")
    codes = codes[order]
    levels = _levels(codes, cube, block.level, taken)
    for level in range(cube.last_level + 1):
        chosen = np.flatnonzero(levels == level)
        if not len(chosen):
            continue
        nodes = codes[chosen] >> 3 * (cube.depth - level)
        starts = _starts(nodes)
        for first, last in zip(starts, [*starts[1:], len(nodes)], strict=True):
            # as they were measured, which compresses best
            rows = block.rows[np.sort(order[chosen[first:last]])]
            code = int(nodes[first])
            if level < block.level:
                key = np.full(len(rows), code | 1 << 3 * level, np.int64)
                coarse.add(key, {_COLUMN: rows})
            else:
                yield cube.node(level, code), rows


def _levels(
    codes: NDArray[np.int64], cube: Cube, level_of_block: int, taken: set[tuple[int, int]]
) -> NDArray[np.int8]:
    """Return the level (N,) at which each point is kept.

    Parameters
    ----------
    codes : (N,) increasing, all of one block
    taken : cells larger than blocks, by their level and code, that have their point
    """
    levels = np.full(len(codes), -1, np.int8)
    left = np.arange(len(codes))
    for level in range(cube.last_level + 1):
        if not len(left):
            break
        own = codes[left]
        rest = np.ones(len(left), np.bool_)
        if level >= level_of_block:
            n = _runs(own >> 3 * (cube.depth - level))
            rest = n > _FULL if level < cube.last_level else np.zeros(len(left), np.bool_)
        finest = level + _GRID_LEVELS
        cells = own >> 3 * (cube.depth - finest)
        starts = _starts(cells)
        middles = (starts + np.append(starts[1:], len(cells)) - 1) // 2
        if finest >= level_of_block:
            rest[middles] = False
        elif (level, int(cells[0])) not in taken:
            taken.add((level, int(cells[0])))
            rest[middles] = False
        if level + 1 >= level_of_block and level < cube.last_level:
            behind = np.flatnonzero(rest)
            n = _runs(own[behind] >> 3 * (cube.depth - level - 1))
            rest[behind[n < _FEW]] = False
        levels[left[~rest]] = level
        left = left[rest]
    return levels


def _starts(ordered: NDArray[np.int64]) -> NDArray[np.intp]:
    """Return where runs of equal numbers begin."""
    return np.flatnonzero(np.append(True, ordered[1:] != ordered[:-1])[: len(ordered)])


def _runs(ordered: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the length (N,) of the run that each number is in."""
    starts = _starts(ordered)
    lengths = np.diff(np.append(starts, len(ordered)))
    return np.repeat(lengths, lengths)
