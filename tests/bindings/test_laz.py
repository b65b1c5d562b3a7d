# SPDX-License-Identifier: MIT OR Apache-2.0
"""The compressor of the core against laspy's own."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import laspy
import lazrs
import numpy as np
import pytest

from bentwing import _core

if TYPE_CHECKING:
    from pathlib import Path

RECORD = laspy.LasHeader(point_format=6, version="1.4").point_format.dtype()


def some_points(n: int) -> np.ndarray:
    rng = np.random.default_rng(4)
    points = np.zeros(n, RECORD)
    points["X"] = np.cumsum(rng.integers(-40, 40, n))
    points["Y"], points["Z"] = rng.integers(-(10**6), 10**6, (2, n))
    points["gps_time"] = np.linspace(0.0, 9.0, n)
    return points


def compressed(path: Path, points: np.ndarray, n_parts: int, threads: int) -> bytes:
    path.write_bytes(b"header")
    compressor = _core.LazCompressor(6, 0)
    compressor.begin(path, 6)
    for part in np.array_split(points, n_parts):
        compressor.compress(np.frombuffer(part.tobytes(), np.uint8), threads=threads)
    compressor.finish(threads=threads)
    return path.read_bytes()


@pytest.mark.parametrize("threads", [1, 2, 4])
def test_the_bytes_do_not_depend_on_the_threads_nor_on_the_parts(
    tmp_path: Path, threads: int
) -> None:
    points = some_points(130_001)
    reference = compressed(tmp_path / "a", points, 1, 1)
    assert compressed(tmp_path / "b", points, 7, threads) == reference


def test_laspy_reads_what_was_compressed(tmp_path: Path) -> None:
    points, header = some_points(60_000), laspy.LasHeader(point_format=6, version="1.4")
    expected = io.BytesIO()
    with laspy.LasWriter(expected, header, do_compress=True, closefd=False) as writer:
        writer.write_points(laspy.PackedPointRecord(points, header.point_format))
    start = laspy.LasReader(io.BytesIO(expected.getvalue())).header.offset_to_point_data
    ours = compressed(tmp_path / "ours", points, 3, 2)
    whole = bytearray(expected.getvalue()[:start])
    # Where the table of chunks stands is counted from the start of the file.
    table = int.from_bytes(ours[6:14], "little") - 6 + start
    whole += table.to_bytes(8, "little") + ours[14:]
    read = laspy.read(io.BytesIO(bytes(whole)))
    np.testing.assert_array_equal(read.points.array, points)


def test_half_a_point_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "points"
    path.touch()
    compressor = _core.LazCompressor(6, 0)
    compressor.begin(path, 0)
    with pytest.raises(ValueError, match="points: expected a multiple of 30 bytes, got 31"):
        compressor.compress(np.zeros(31, np.uint8))


def test_points_before_the_header_are_refused() -> None:
    with pytest.raises(ValueError, match=r"begin\(\) was not called"):
        _core.LazCompressor(6, 0).compress(np.zeros(30, np.uint8))


def test_an_unknown_point_format_is_refused() -> None:
    with pytest.raises(ValueError, match="point_format"):
        _core.LazCompressor(99, 0)


def test_a_missing_file_is_an_os_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        _core.LazCompressor(6, 0).begin(tmp_path / "missing", 0)


def test_chunks_have_the_sizes_they_are_given(tmp_path: Path) -> None:
    path, counts = tmp_path / "points", [3, 1, 500]
    path.touch()
    points = np.random.default_rng(0).integers(0, 255, (sum(counts), 30)).astype(np.uint8)
    laz = _core.LazCompressor(6, 0, own_chunks=True)
    laz.begin(path, 0)
    laz.compress_chunks(points[:4].ravel(), counts[:2])
    laz.compress_chunks(points[4:].ravel(), counts[2:], threads=1)
    laz.finish()
    with path.open("rb") as file:
        chunks = lazrs.read_chunk_table(file, lazrs.LazVlr(laz.record_data()))
    assert [n for n, _ in chunks] == counts


@pytest.mark.parametrize("counts", [[3], [0, 2], [2**63, 2**63, 2], []])
def test_counts_that_are_not_those_of_the_points_are_refused(
    tmp_path: Path, counts: list[int]
) -> None:
    (tmp_path / "points").touch()
    laz = _core.LazCompressor(6, 0, own_chunks=True)
    laz.begin(tmp_path / "points", 0)
    with pytest.raises(ValueError, match="counts"):
        laz.compress_chunks(np.zeros(2 * 30, np.uint8), counts)


def test_a_file_has_chunks_of_one_size_or_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "points").touch()
    own, one = _core.LazCompressor(6, 0, own_chunks=True), _core.LazCompressor(6, 0)
    for laz in (own, one):
        laz.begin(tmp_path / "points", 0)
    with pytest.raises(ValueError, match="compress_chunks"):
        own.compress(np.zeros(30, np.uint8))
    with pytest.raises(ValueError, match=r"compress\(\)"):
        one.compress_chunks(np.zeros(30, np.uint8), [1])
