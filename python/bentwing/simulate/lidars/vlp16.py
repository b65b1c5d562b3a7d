# SPDX-License-Identifier: MIT OR Apache-2.0
"""Velodyne VLP-16: 16 beams over ±15°, 10 revolutions and 289,000 shots per second."""

from __future__ import annotations

import numpy as np

from bentwing.simulate.lidars.rotating import Rotating

ORDER = (0, 8, 1, 9, 2, 10, 3, 11, 4, 12, 5, 13, 6, 14, 7, 15)
"""Ring (from below) of each laser in the order of firing."""
NOISE = 0.02
BEAM_SIGMA = float(np.radians(0.05))


def vlp16(max_range: float) -> Rotating:
    """Build the lidar."""
    return Rotating(
        rings=ORDER,
        elevations=tuple(np.radians(-15.0 + 2.0 * np.array(ORDER)).tolist()),
        azimuths=(0.0,) * 16,
        firing=55.296e-6,
        shot=2.304e-6,
        n_firings=1808,
        max_range=max_range,
        noise=NOISE,
        beam_sigma=BEAM_SIGMA,
    )
