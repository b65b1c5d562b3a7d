# SPDX-License-Identifier: MIT OR Apache-2.0
"""Ouster OS1-64: 64 beams over 45°, 1024 columns in each of 10 revolutions per second."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.lidars.rotating import PERIOD, Revolution, Rotating

if TYPE_CHECKING:
    from numpy.typing import NDArray

N_BEAMS, N_COLUMNS = 64, 1024
STAGGER = (3.16, 1.05, -1.05, -3.16)
"""deg, azimuths of beams that follow each other; the lasers stand in four columns."""
OUSTER_POINT = np.dtype(
    {
        "names": ["x", "y", "z", "intensity", "t", "reflectivity", "ring", "ambient", "range"],
        "formats": ["<f4", "<f4", "<f4", "<f4", "<u4", "<u2", "<u2", "<u2", "<u4"],
        "offsets": [0, 4, 8, 16, 20, 24, 26, 28, 32],
        "itemsize": 48,
    }
)
"""A point as Ouster's driver packs it."""


def os1_64(max_range: float) -> Rotating:
    """Build the lidar; its rings count from above."""
    return Rotating(
        rings=tuple(range(N_BEAMS)),
        elevations=tuple(np.radians(np.linspace(22.5, -22.5, N_BEAMS)).tolist()),
        azimuths=tuple(np.radians(np.resize(STAGGER, N_BEAMS)).tolist()),
        firing=PERIOD / N_COLUMNS,
        shot=0.0,
        n_firings=N_COLUMNS,
        max_range=max_range,
        noise=0.015,
        beam_sigma=float(np.radians(0.05)),
        pack=ouster_points,
    )


def ouster_points(revolution: Revolution) -> NDArray[np.void]:
    """Pack all shots, one row for each beam; those without a return are zeros."""
    returned = revolution.returned()
    ranges = np.where(returned, revolution.ranges, 0.0)
    points = np.zeros(returned.shape, dtype=OUSTER_POINT)
    xyz = revolution.directions * ranges[..., None]
    for axis, name in enumerate("xyz"):
        points[name] = xyz[..., axis]
    points["intensity"] = np.where(returned, np.round(10.0 + 90.0 * revolution.cosines), 0.0)
    points["t"] = np.round(revolution.since * 1e9)
    points["ring"] = revolution.rings
    points["range"] = np.round(ranges * 1e3)
    return np.ascontiguousarray(points.T)
