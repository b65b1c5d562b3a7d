# SPDX-License-Identifier: MIT OR Apache-2.0
"""Velodyne HDL-64E: 64 beams from 2° above to 24.3° below, 10 revolutions a second.

Every second column is simulated, as in recordings that were thinned to be carried: 666,000 shots
per second.
"""

from __future__ import annotations

import numpy as np

from bentwing.simulate.lidars.rotating import Rotating

UPPER = np.linspace(2.0, -8.33, 32)
LOWER = np.linspace(-8.83, -24.33, 32)
"""deg, of the two blocks of lasers."""
FIRING = 96e-6
"""s, of two columns."""
BEAM_SIGMA = float(np.radians(0.2))
"""rad; the beams of a calibrated sensor are up to 0.2° off, those of many tables 0.4°."""


def hdl64(max_range: float) -> Rotating:
    """Build the lidar; its rings count from below."""
    elevations = np.radians(np.concatenate([UPPER, LOWER])[::-1])
    return Rotating(
        rings=tuple(range(64)),
        elevations=tuple(elevations.tolist()),
        azimuths=(0.0,) * 64,
        firing=FIRING,
        shot=0.72e-6,
        n_firings=1041,
        max_range=max_range,
        noise=0.02,
        beam_sigma=BEAM_SIGMA,
    )
