# SPDX-License-Identifier: MIT OR Apache-2.0
"""Two long straight drives joined by cross-cuts: along a drive there is little to hold on to."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.scenes.mesh import Mesh, merge, sheet, smooth_noise
from bentwing.simulate.scenes.world import Site

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

STEP = 0.45
"""m, size of the facets."""
NEIGHBOURS = ((1, 0), (-1, 0), (0, 1), (0, -1))


def mine(rng: np.random.Generator) -> Site:
    """Drive two galleries of about 60 m, 4.5 m wide and 4 m high."""
    length, width, height = rng.uniform(56.0, 64.0), rng.uniform(4.2, 4.8), rng.uniform(3.6, 4.2)
    pillar = rng.uniform(9.0, 12.0)
    ys = [0.0, width, width + pillar, 2 * width + pillar]
    cuts = np.sort(np.array([0.2, 0.5, 0.8]) * length + rng.uniform(-3.0, 3.0, 3))
    xs = [0.0, *[x for cut in cuts for x in (cut, cut + width)], length]
    is_open = np.ones((len(xs) - 1, 3), dtype=bool)
    is_open[::2, 1] = False
    mesh = merge(_surfaces(xs, ys, is_open, height))
    low, high = (2.0, 1.2, 1.2), (length - 2.0, ys[-1] - 1.2, height - 1.1)
    return Site(_roughened(rng, mesh), low, high, pad_below=0.4, speed=1.0)


def _surfaces(xs: list[float], ys: list[float], is_open: NDArray[np.bool_], h: float) -> list[Mesh]:
    """Floor and roof of every open cell, and walls where it meets rock."""
    parts = []
    n_x, n_y = is_open.shape
    for i, (x0, x1) in enumerate(pairwise(xs)):
        for j, (y0, y1) in enumerate(pairwise(ys)):
            if not is_open[i, j]:
                continue
            parts.append(_rectangle((x0, y0, 0), (x1 - x0, 0, 0), (0, y1 - y0, 0)))
            parts.append(_rectangle((x0, y0, h), (0, y1 - y0, 0), (x1 - x0, 0, 0)))
            for a, b in NEIGHBOURS:
                inside = 0 <= i + a < n_x and 0 <= j + b < n_y
                if not (inside and is_open[i + a, j + b]):
                    parts.append(_wall((x0, x1), (y0, y1), h, (a, b)))
    return parts


def _wall(x: tuple[float, float], y: tuple[float, float], h: float, side: tuple[int, int]) -> Mesh:
    """Build the wall on one side of a cell, seen from the cell."""
    dx, dy = x[1] - x[0], y[1] - y[0]
    match side:
        case (1, 0):
            return _rectangle((x[1], y[0], 0), (0, 0, h), (0, dy, 0))
        case (-1, 0):
            return _rectangle((x[0], y[0], 0), (0, dy, 0), (0, 0, h))
        case (0, 1):
            return _rectangle((x[0], y[1], 0), (dx, 0, 0), (0, 0, h))
        case _:
            return _rectangle((x[0], y[0], 0), (0, 0, h), (dx, 0, 0))


def _rectangle(corner: tuple[float, ...], a: tuple[float, ...], b: tuple[float, ...]) -> Mesh:
    """Build a subdivided rectangle facing a × b."""
    u, v = np.array(a, dtype=np.float64), np.array(b, dtype=np.float64)
    n_u, n_v = (int(np.ceil(np.linalg.norm(w) / STEP)) + 1 for w in (u, v))
    s, t = np.meshgrid(np.linspace(0, 1, n_u), np.linspace(0, 1, n_v), indexing="ij")
    return sheet(np.array(corner) + s[..., None] * u + t[..., None] * v)


def _roughened(rng: np.random.Generator, mesh: Mesh) -> Mesh:
    """Displace every vertex by a field of its position, so that edges stay closed."""
    fields = [smooth_noise(rng, w, a, 3) for w, a in ((2.2, 0.05), (0.9, 0.015)) for _ in range(3)]
    moves = np.stack([field(mesh.vertices) for field in fields], axis=-1)
    return Mesh(mesh.vertices + moves[:, :3] + moves[:, 3:], mesh.triangles)
