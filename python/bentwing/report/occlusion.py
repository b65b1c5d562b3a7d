# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ambient occlusion of a picture: how much of the light from the viewer's side reaches each pixel."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_RADII = (1, 2, 4, 8, 16, 32)  # small pixels; how far something can take light away
_DIRECTIONS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))
_SMALL = 3  # pixels per edge of a small pixel; what is farther away needs no detail
_BRIGHT = 66.0  # percentile that counts as fully lit


def ambient(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the light (H, W), 0 to 1, that reaches each pixel, 1 for the brightest third.

    The picture is a field of heights lit evenly from all of the hemisphere above it. In each of eight
    directions the horizon is the steepest rise within about a hundred pixels; what is below it is dark.
    Light falls as the cosine, so that a horizon at the angle h leaves 1 − sin² h.

    Parameters
    ----------
    depth : (H, W), pixels towards the viewer, minus infinity where nothing is

    References
    ----------
    Bavoil and Sainz 2008, horizon-based ambient occlusion; Zhukov et al. 1998.
    """
    heights = _shrunk(depth) / np.float32(_SMALL)
    margin = max(_RADII)
    around = np.pad(heights, margin, constant_values=-np.inf)
    rows, columns = heights.shape
    # what is empty hides behind everything, but takes light from nothing
    floor = np.where(np.isfinite(heights), heights, np.float32(np.inf))
    light = np.zeros_like(heights)
    rise = np.empty_like(heights)
    for down, right in _DIRECTIONS:
        step = np.float32(np.hypot(down, right))
        steepest = np.zeros_like(heights)
        for radius in _RADII:
            row, column = margin + radius * down, margin + radius * right
            np.subtract(around[row : row + rows, column : column + columns], floor, out=rise)
            rise /= radius * step
            np.maximum(steepest, rise, out=steepest)
        # 1 − sin² of the angle whose tangent is the rise
        light += 1.0 / (1.0 + steepest * steepest)
    light /= len(_DIRECTIONS)
    seen = light[np.isfinite(heights)]
    if len(seen):  # a surface that leans from the viewer is as bright as one that faces him
        light = np.minimum(light / np.percentile(seen, _BRIGHT), np.float32(1))
    return _enlarged(light, depth.shape)


def _shrunk(depth: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the nearest depth of each block: means would fall through walls that have gaps."""
    rows, columns = (-(-size // _SMALL) * _SMALL for size in depth.shape)
    filled = np.full((rows, columns), -np.inf, np.float32)
    filled[: depth.shape[0], : depth.shape[1]] = depth
    blocks = filled.reshape(rows // _SMALL, _SMALL, columns // _SMALL, _SMALL)
    shrunk: NDArray[np.float32] = blocks.max(axis=(1, 3))
    return shrunk


def _enlarged(light: NDArray[np.float32], shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return the light of small pixels in a picture's own, smooth between their centres."""
    for axis, size in enumerate(shape[:2]):
        at = np.clip((np.arange(size) + 0.5) / _SMALL - 0.5, 0, light.shape[axis] - 1)
        low = np.minimum(at.astype(np.intp), max(light.shape[axis] - 2, 0))
        high = np.minimum(low + 1, light.shape[axis] - 1)
        share = (at - low).astype(np.float32)
        share = share[:, None] if axis == 0 else share
        light = light.take(low, axis) * (1 - share) + light.take(high, axis) * share
    return light
