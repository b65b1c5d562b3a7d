# SPDX-License-Identifier: MIT OR Apache-2.0
"""Our kernels and those of other packages on the same data, as ratios within one run.

Neighbours
    The two nearest of each surfel among those of another time, within distance one in six
    dimensions (position in voxels, normal). Others cannot exclude by time. They run twice: for so
    many neighbours that 99 % of the true ones are among them, which is what a gated search costs
    with them, and for two, which is another and easier question. They get the queries sorted by
    cells for free. All times include the construction of the index.
Surfels
    Placing, surfels of four levels with normals and covariances, beside small_gicp's thinning of
    the placed points on one grid of the finest level's size.
Solution
    Factorization and solution with the analysis of the structure kept, and with it (`anew`),
    beside CHOLMOD.

Needs cargo, and measures what is installed of pykdtree, pynanoflann, scipy, small_gicp
and scikit-sparse. One thread each; the repetitions of all are interleaved.
"""

from __future__ import annotations

import argparse
import importlib
import os
import statistics
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

# Before any of them is loaded.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")

import numpy as np

from benches.support import tables
from bentwing.odometry.continuous.settings import RegistrationSettings, SurfelSettings

if TYPE_CHECKING:
    from collections.abc import Callable
    from types import ModuleType

    Work = Callable[[], float]

ROOT = Path(__file__).parents[2]
MATCHING = RegistrationSettings()
K, RADIUS, GAP = MATCHING.n_neighbors, MATCHING.max_match_distance, MATCHING.min_match_gap
VOXEL = SurfelSettings().voxel_size
RECALL = 0.99
ABSENT = np.iinfo(np.uint32).max


class Ours:
    """The program `kernels`, which runs one of our kernels when it is asked to."""

    def __init__(self, folder: Path) -> None:
        command = ["cargo", "run", "--quiet", "--release", "--package", "bentwing_benches"]
        self._process = subprocess.Popen(
            [*command, "--bin", "kernels", "--", str(folder)],
            cwd=ROOT,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.cases = self._answer().split()

    def run(self, case: str) -> float:
        """Seconds of one repetition."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{case}\n")
        self._process.stdin.flush()
        return float(self._answer())

    def close(self) -> None:
        self._process.communicate()

    def _answer(self) -> str:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit("the program of our kernels has ended")
        return line


def installed(name: str) -> ModuleType | None:
    try:
        return importlib.import_module(name)
    except ImportError:
        return None


def timed(work: Callable[[], object]) -> Work:
    def run() -> float:
        start = time.perf_counter()
        work()
        return time.perf_counter() - start

    return run


def compare(title: str, works: dict[str, Work], repeats: int) -> None:
    """Print medians; the first of the works is what the others are divided by."""
    seconds: dict[str, list[float]] = {name: [] for name in works}
    for work in works.values():
        work()  # warms up
    for _ in range(repeats):
        for name, work in works.items():
            seconds[name].append(work())
    ours = next(iter(seconds.values()))
    print(f"\n{title}\n\n{tables.head(('', 'time', 'times ours'))}")
    for name, times in seconds.items():
        ratio = statistics.median(a / b for a, b in zip(times, ours, strict=True))
        cells = [name, f"{1e3 * statistics.median(times):.2f} ms", f"{ratio:.2f}"]
        print(tables.line(cells), flush=True)


Found = tuple[np.ndarray, np.ndarray]
"""Distances and indices (N, k)."""


def trees() -> dict[str, Callable[[np.ndarray, int], Found]]:
    """Searches of a table in itself, by the name of the package."""
    kdtree, nanoflann, spatial = map(installed, ("pykdtree.kdtree", "pynanoflann", "scipy.spatial"))
    found: dict[str, Callable[[np.ndarray, int], Found]] = {}
    if kdtree is not None:
        found["pykdtree"] = lambda table, k: kdtree.KDTree(table).query(
            table, k, distance_upper_bound=RADIUS
        )
    if nanoflann is not None:

        def search(table: np.ndarray, k: int) -> Found:
            tree = nanoflann.KDTree(n_neighbors=k)
            tree.fit(table)
            return tree.kneighbors(table)

        found["nanoflann"] = search
    if spatial is not None:
        found["scipy"] = lambda table, k: spatial.cKDTree(table).query(
            table, k, distance_upper_bound=RADIUS
        )
    return found


def true_neighbors(table: np.ndarray, times: np.ndarray, queries: np.ndarray) -> np.ndarray:
    """Squared distances (Q, K) of the nearest at another time, by brute force; infinite where none."""
    times = times.astype(np.float32)
    best = np.full((len(queries), K), np.inf, dtype=np.float32)
    for row, query in zip(best, queries, strict=True):
        squares = ((table - table[query]) ** 2).sum(axis=1)
        squares[np.abs(times - times[query]) <= GAP] = np.inf
        row[:] = np.sort(np.partition(squares, K)[:K])
    best[best > RADIUS**2] = np.inf
    return best


def recall(found: np.ndarray, true: np.ndarray, case: tuple[np.ndarray, ...]) -> float:
    """Share of the true neighbours that are among those found, once these are gated."""
    table, times, queries = case
    times = times.astype(np.float32)
    valid = found < len(table)
    rows = np.where(valid, found, 0)
    squares = ((table[rows] - table[queries][:, None]) ** 2).sum(axis=2)
    apart = np.abs(times[rows] - times[queries][:, None]) > GAP
    squares[~(valid & apart)] = np.inf
    nearest = np.sort(squares, axis=1)[:, :K]
    # Of two at the same distance either will do.
    hit = np.isfinite(true) & (nearest <= true * (1 + 1e-5) + 1e-9)
    return float(hit.sum() / np.isfinite(true).sum())


def neighbors(ours: Ours, folder: Path, name: str, repeats: int) -> None:
    load = lambda file: np.load(folder / f"{file}.npy")  # noqa: E731
    table, times, found = load("features"), load("times"), load("found")
    queries = np.random.default_rng(0).permutation(len(table))[:2000]
    true = true_neighbors(table, times, queries)
    case = table, times, queries
    exact = recall(found[queries], true, case)
    works: dict[str, Work] = {
        f"bentwing, gated, recall {100 * exact:.2f} %": partial(ours.run, name)
    }
    order = np.lexsort(np.floor(table[:, 2::-1]).T)
    ordered = np.ascontiguousarray(table[order])
    for package, search in trees().items():
        k, reached = K, 0.0
        while reached < RECALL and k < 2**10:
            k += max(1, k // 4)
            indices = order[np.minimum(search(ordered, k)[1], len(table) - 1)]
            by_original = np.empty_like(indices)
            by_original[order] = indices
            reached = recall(by_original[queries], true, case)
        label = f"{package}, {k} neighbours, recall {100 * reached:.1f} %"
        works[label] = timed(partial(search, ordered, k))
        works[f"{package}, {K} neighbours, not gated"] = timed(partial(search, ordered, K))
    compare(f"{name}: {len(table):,} features", works, repeats)


def surfels(ours: Ours, folder: Path, name: str, repeats: int) -> None:
    points = np.load(folder / "points.npy")
    works: dict[str, Work] = {"bentwing, four levels": partial(ours.run, name)}
    if (gicp := installed("small_gicp")) is not None:
        cloud = gicp.PointCloud(points)
        works["small_gicp, one grid, no normals"] = timed(
            lambda: gicp.voxelgrid_sampling(cloud, VOXEL, num_threads=1)
        )
    compare(f"{name}: {len(points):,} points", works, repeats)


def solve(ours: Ours, folder: Path, name: str, repeats: int) -> None:
    load = lambda file: np.load(folder / f"{file}.npy")  # noqa: E731
    right, x = load("right"), load("solution")
    works = {
        "bentwing": partial(ours.run, name),
        "bentwing, anew": partial(ours.run, f"{name}/anew"),
    }
    variants = (f"{name}/dense", f"{name}/sparse")
    works |= {
        f"bentwing, {v.rsplit('/', 1)[1]}": partial(ours.run, v)
        for v in variants
        if v in ours.cases
    }
    cholmod, sparse = installed("sksparse.cholmod"), installed("scipy.sparse")
    if cholmod is not None and sparse is not None:
        n = len(right)
        lower = sparse.csc_matrix((load("values"), load("rows"), load("starts")), shape=(n, n))
        factor = cholmod.analyze(lower)

        def again() -> np.ndarray:
            factor.cholesky_inplace(lower)
            return factor(right)

        error = np.abs(again() - x).max() / np.abs(x).max()
        assert error < 1e-6, f"{name}: the solutions differ by {error:g}"
        works["CHOLMOD"] = timed(again)
        works["CHOLMOD, anew"] = timed(lambda: cholmod.cholesky(lower)(right))
    compare(f"{name}: {len(right):,} unknowns", works, repeats)


def main() -> None:
    """Print a table for each case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("cases", nargs="*", help="beginnings of the cases' names; all by default")
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    kernels = {"neighbors": neighbors, "surfels": surfels, "solve": solve}
    with tempfile.TemporaryDirectory() as data:
        ours = Ours(Path(data))
        for case in ours.cases:
            room, _, variant = case.partition("/")
            chosen = not options.cases or case.startswith(tuple(options.cases))
            if chosen and "/" not in variant:
                kernels[room](ours, Path(data) / case, case, options.repeats)
        ours.close()
