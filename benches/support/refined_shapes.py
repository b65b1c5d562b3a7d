# SPDX-License-Identifier: MIT OR Apache-2.0
"""Shapes whose truth is exact, measured with noise along the beams, and what refinement makes of them."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from scipy.special import ndtr

from benches.support import tables
from bentwing.map.chunk import MapChunk
from bentwing.map.refine import refine

NOISE, DURATION = 0.01, 30.0
DENSITY = 5000  # points per m²
N_DRAWS = 5  # of each step
STEPS = (0.005, 0.01, 0.02, 0.03, 0.05)
RADII = (0.05, 0.1, 0.2, 0.4)
PLATES = (0.02, 0.04, 0.06)
BLURS = np.geomspace(0.0005, 0.1, 100)  # m, standard deviations
TENTHS = 2.563  # of them from a tenth to nine tenths


def measured(true, origins, rng) -> MapChunk:
    """Points of a surface, each seen from a place, with noise along the beam."""
    gaps = true - origins
    ranges = np.linalg.norm(gaps, axis=1)
    beams = gaps / ranges[:, None]
    ranges = ranges + NOISE * rng.normal(size=len(true))
    times = np.sort(rng.uniform(0, DURATION, len(true)))
    points = origins + beams * ranges[:, None]
    return MapChunk(points, times, ranges.astype(np.float32), beams=beams.astype(np.float32))


def refined(chunk: MapChunk):
    """Where the points are after refinement, (N, 3) m."""
    with tempfile.TemporaryDirectory() as scratch:
        (found,) = refine(iter([chunk]), Path(scratch))
    return found.points


def above(n: int, rng):
    return np.c_[rng.uniform(-1.5, 1.5, (n, 2)), rng.uniform(2, 4, n)]


def width(along, heights, rise: float) -> float:
    """Distance over which a step that is blurred most like the points goes from a tenth to nine tenths, m."""
    near = np.abs(along) < 0.15
    x, z = along[near], heights[near]
    misfits = [np.sum((z - rise * ndtr(x / blur)) ** 2) for blur in BLURS]
    return TENTHS * float(BLURS[int(np.argmin(misfits))])


def step(height: float, rng) -> list[str]:
    draws = [_drawn_step(height, rng) for _ in range(N_DRAWS)]
    cells = [
        f"{1e3 * kept:.1f} mm, {1e3 * wide:.0f} mm wide" for kept, wide in np.mean(draws, axis=0)
    ]
    return [f"step of {1e3 * height:.0f} mm", *cells]


def _drawn_step(height: float, rng) -> list[tuple[float, float]]:
    """Height and width, m, of the points as measured and as refined."""
    n = 4 * DENSITY
    true = np.c_[rng.uniform(-1, 1, (n, 2)), np.zeros(n)]
    true[true[:, 0] > 0, 2] = height
    chunk = measured(true, above(n, rng), rng)
    found = []
    for points in (chunk.points, refined(chunk)):
        near = np.abs(points[:, 0]) < 0.06
        up, down = near & (points[:, 0] > 0.01), near & (points[:, 0] < -0.01)
        kept = points[up, 2].mean() - points[down, 2].mean()
        found.append((kept, width(points[:, 0], points[:, 2], height)))
    return found


def crease(rng, *, convex: bool) -> list[str]:
    n = 6 * DENSITY
    along, y, on_floor = rng.uniform(0, 1, n), rng.uniform(-1, 1, n), rng.random(n) < 0.5
    side, zero = -along if convex else along, np.zeros(n)
    true = np.where(on_floor[:, None], np.c_[side, y, zero], np.c_[zero, y, side])
    origins = np.c_[rng.uniform(1, 3, n), rng.uniform(-1, 1, n), rng.uniform(1, 3, n)]
    chunk = measured(true, origins, rng)
    near = np.abs(side) < 0.05
    cells = []
    for points in (chunk.points, refined(chunk)):
        off = np.where(on_floor, points[:, 2], points[:, 0])[near]
        cells.append(
            f"rms {1e3 * np.sqrt(np.mean(off**2)):.1f} mm, mean {1e3 * off.mean():+.2f} mm"
        )
    return [f"5 cm beside a {'convex' if convex else 'concave'} crease", *cells]


def cylinder(radius: float, rng) -> list[str]:
    n = int(2 * np.pi * radius * 1.4 * DENSITY * 2)
    angle = rng.uniform(0, 2 * np.pi, n)
    true = np.c_[radius * np.cos(angle), radius * np.sin(angle), rng.uniform(-0.7, 0.7, n)]
    seen, away = angle + rng.uniform(-1.2, 1.2, n), rng.uniform(1.5, 3.5, n)
    chunk = measured(
        true, np.c_[away * np.cos(seen), away * np.sin(seen), rng.uniform(-1, 1, n)], rng
    )
    inner = np.abs(true[:, 2]) < 0.5
    cells = []
    for points in (chunk.points, refined(chunk)):
        off = np.hypot(points[inner, 0], points[inner, 1]) - radius
        cells.append(f"radius {1e3 * off.mean():+.2f} mm, std {1e3 * off.std():.1f} mm")
    return [f"cylinder of {100 * radius:.0f} cm", *cells]


def plate(apart: float, rng) -> list[str]:
    n = 2 * DENSITY
    sides = np.where(rng.random(n) < 0.5, 1.0, -1.0)
    true = np.c_[rng.uniform(-0.5, 0.5, (n, 2)), sides * apart / 2]
    chunk = measured(true, above(n, rng) * np.c_[np.ones((n, 2)), sides], rng)
    cells = []
    for points in (chunk.points, refined(chunk)):
        top, bottom = points[sides > 0, 2], points[sides < 0, 2]
        spread = max(top.std(), bottom.std())
        cells.append(
            f"{1e3 * (top.mean() - bottom.mean()):.2f} mm apart, std {1e3 * spread:.1f} mm"
        )
    return [f"plate of {1e3 * apart:.0f} mm", *cells]


def show() -> None:
    """Print a row per shape."""
    print(tables.head(("shape", "measured", "refined")))
    rng = np.random.default_rng(1)
    rows = [step(height, rng) for height in STEPS]
    rows += [crease(rng, convex=convex) for convex in (False, True)]
    rows += [cylinder(radius, rng) for radius in RADII]
    rows += [plate(apart, rng) for apart in PLATES]
    for cells in rows:
        print(tables.line(cells), flush=True)
