# SPDX-License-Identifier: MIT OR Apache-2.0
"""Returns between two surfaces: a beam that meets an edge is reflected by what is on both sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

# m; a return closer to one of its neighbours is on the same surface, and would blur it no more
# than the noise of a time-of-flight lidar does.
MIN_STEP = 0.1
# On one side of an edge at least a surface goes on: its next step is at most this share of the
# smaller one, or it is a return among leaves.
GOES_ON = 0.3
# A plane seen at a grazing angle has such steps as well. The inverse of its range is linear in the
# angle, so its returns stay within this share of the smaller step of what their neighbours say.
PLANAR = 0.35
MAX_ANGLE = 0.03  # rad; what is farther apart are no neighbours


def mixed_pixels(
    points: NDArray[np.float64],
    ranges: NDArray[np.float64],
    times: NDArray[np.float64],
    ring: NDArray[np.uint16] | None,
) -> NDArray[np.bool_]:
    """Return which returns may be of two surfaces at once.

    A return is doubtful if it lies between its neighbours in the scan line, clearly behind the one
    and before the other, if a surface ends beside it, and if it is not on a plane with them.

    Parameters
    ----------
    points : (N, 3) float64, m, lidar frame
    ranges : (N,) float64, m, their distances from the lidar
    times : (N,) float64, s, non-decreasing
    ring : (N,) uint16 or None, beam number; the returns of a beam are a scan line

    Returns
    -------
    (N,) bool; some twigs are doubtful, too, so that further evidence must decide
    """
    found = np.zeros(len(times), dtype=np.bool_)
    if len(times) < 5:
        return found
    order = np.arange(len(times)) if ring is None else np.argsort(ring, kind="stable")
    ranges, times = ranges.take(order), times.take(order)
    steps = np.diff(ranges)
    sizes = np.abs(steps)
    smaller = np.minimum(sizes[1:-2], sizes[2:-1])
    is_between = (steps[1:-2] * steps[2:-1] > 0) & (smaller > MIN_STEP)
    go_on = np.minimum(sizes[:-3], sizes[3:]) < GOES_ON * smaller
    # Few returns come so far, and only they are looked at closely.
    at = 2 + np.flatnonzero(is_between & go_on)
    if ring is not None:
        same = ring[order[at]]
        at = at[(ring[order[at - 2]] == same) & (ring[order[at + 2]] == same)]
    if not len(at):
        return found
    # The beam times of all neighbours are alike; a longer pause is a new scan or lost returns.
    pauses = np.diff(times)
    usual = 2.5 * max(float(np.median(pauses)), 1e-7)
    near = (pauses[at - 1] <= usual) & (pauses[at] <= usual)
    before, here, behind = (points[order[at + i]] / ranges[at + i, None] for i in (-1, 0, 1))
    # Of the small angles that matter here.
    first, second = np.linalg.norm(here - before, axis=1), np.linalg.norm(behind - here, axis=1)
    near &= (first < MAX_ANGLE) & (second < MAX_ANGLE)
    share = first / np.maximum(first + second, 1e-9)
    inverse = (1 - share) / ranges[at - 1] + share / ranges[at + 1]
    off = np.abs(ranges[at] - 1 / inverse)
    found[order[at]] = near & (off > PLANAR * smaller[at - 2])
    return found
