# SPDX-License-Identifier: MIT OR Apache-2.0
"""How densely and how often each part of the site was measured, seen from above."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.voxels import by_key
from bentwing.report.colours import HEIGHT, TIME, colour
from bentwing.report.picture import PAPER, View, thinned
from bentwing.report.svg import map_view
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.report.texts import Texts

_CELLS = 160  # along the longer side of the map
_FINEST = 0.1  # m, edge of a cell
_WIDTH = 640  # pixels of the picture, about
_APART = 10.0  # s without any point in a cell, which divide two visits
_MOST_VISITS = 8.0  # at the end of the colour map at least this many
_FLOATING = 0.02  # of a cell's points at either end are no surface
_STEPS = 1 << 40  # from the lowest to the highest point
_FEWEST = 3  # sampled points in a cell that count as seen


@dataclass(frozen=True, slots=True)
class Coverage:
    """Plans of density and visits, and what they say.

    Attributes
    ----------
    density, visits : SVG
    cell : m, edge of the squares that are counted
    area : m², of the squares that were seen
    volume : m³, of these squares from the lowest to the highest surface
    median_density : points per m² of plan, of the squares that were seen
    share_again : of the area that was seen in more than one visit
    """

    density: str
    visits: str
    cell: float
    area: float
    volume: float
    median_density: float
    share_again: float


def draw_coverage(
    points: NDArray[np.float64], times: NDArray[np.float64], n_points: int, texts: Texts = ENGLISH
) -> Coverage | None:
    """Count points and visits in squares of the plan; None where there is nothing to count.

    Parameters
    ----------
    points, times : (N, 3) m and (N,) s, an even sample of the map
    n_points : of the whole map
    texts : words of the language
    """
    low, high = np.percentile(thinned(points[:, :2]), [0.2, 99.8], axis=0)
    cell = max(_FINEST, float((high - low).max()) / _CELLS)
    shape = tuple(np.ceil((high - low) / cell).astype(int) + 1)
    place = np.floor((points[:, :2] - low) / cell).astype(np.int64)
    inside = ((place >= 0) & (place < shape)).all(axis=1)
    keys = place[inside, 0] * shape[1] + place[inside, 1]
    counts = np.bincount(keys, minlength=shape[0] * shape[1]).reshape(shape)
    seen = counts >= _FEWEST
    if not seen.any():
        return None
    visits = _visits(keys, times[inside], counts.size).reshape(shape)
    density = counts * (n_points / len(points) / cell**2)
    shown = np.log10(np.maximum(density, 1e-9))
    span = tuple(np.percentile(shown[seen], [2, 98]).tolist())
    most = max(_MOST_VISITS, float(np.percentile(visits[seen], 98)))
    frame = (cell, float(low[0]), float(low[1]))
    return Coverage(
        map_view(
            _picture(shown, seen, span, HEIGHT, frame),
            texts.density_legend,
            HEIGHT,
            name=texts.density,
            ends=(texts.number(10 ** span[0], ",.0f"), texts.number(10 ** span[1], ",.0f")),
        ),
        map_view(
            _picture(visits, seen, (1.0, most), TIME, frame),
            texts.visits_legend,
            TIME,
            name=texts.visits,
            ends=("1", f"{most:.0f}"),
        ),
        cell,
        float(np.count_nonzero(seen) * cell**2),
        float(_heights(keys, points[inside, 2], seen.ravel()).sum() * cell**2),
        float(np.median(density[seen])),
        float((visits[seen] > 1).mean()),
    )


def _heights(
    keys: NDArray[np.int64], z: NDArray[np.float64], seen: NDArray[np.bool_]
) -> NDArray[np.float64]:
    """Return the height (K,) m between the lowest and the highest surface of each cell that was seen."""
    cells = np.flatnonzero(seen)
    lowest = z.min()
    step = max(float(z.max() - lowest), _FINEST) / _STEPS
    # Cell and height in one number: to sort numbers takes a fifth of the time of sorting rows.
    ordered = keys * (_STEPS + 1) + ((z - lowest) / step).astype(np.int64)
    ordered.sort()
    first, last = (np.searchsorted(ordered, n * (_STEPS + 1)) for n in (cells, cells + 1))
    # a point or two that float are no surface
    slack = ((last - first) * _FLOATING).astype(np.int64)
    steps = ordered[last - 1 - slack] - ordered[first + slack]
    heights: NDArray[np.float64] = steps * step
    return heights


def _visits(keys: NDArray[np.int64], times: NDArray[np.float64], n: int) -> NDArray[np.float64]:
    """Count the visits of each of `n` cells."""
    order, starts = by_key(keys, times)
    keys, times = keys[order], times[order]
    again = (keys[1:] == keys[:-1]) & (np.diff(times) > _APART)
    visits = np.bincount(keys[1:][again], minlength=n).astype(np.float64)
    visits[keys[starts]] += 1.0
    return visits


def _picture(
    values: NDArray[np.float64],
    seen: NDArray[np.bool_],
    span: tuple[float, float],
    table: tuple[str, ...],
    frame: tuple[float, float, float],
) -> View:
    """Enlarge cells (across, up) to a picture."""
    cell, left, bottom = frame
    low, high = span
    shade = (values - low) / max(high - low, 1e-9)
    image = np.full((*values.shape, 3), PAPER, np.uint8)
    image[seen] = colour(shade[seen], table)
    times = max(1, round(_WIDTH / max(values.shape)))
    image = image.transpose(1, 0, 2)[::-1].repeat(times, axis=0).repeat(times, axis=1)
    top = bottom + cell * values.shape[1]
    return View(np.ascontiguousarray(image), cell / times, left, top, low, high)
