# SPDX-License-Identifier: MIT OR Apache-2.0
"""Some returns where they truly were, with all errors of their ranges: the best map there can be."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.ranging import AIRFRAME_RANGE, nodes_around

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.rig import Rig

    Array = NDArray[np.float64]

RATE_HZ = 5000.0
"""How many shots are chosen in a second."""


@dataclass(slots=True)
class Samples:
    """Evenly chosen returns.

    A reader of the recording cannot know when late messages were truly measured, nor how an
    elastic mount had turned the lidar; what is collected here knows.
    """

    rig: Rig
    rows: list[Array] = field(default_factory=list)

    def add(self, beams: Beams, ranges: Array) -> None:
        """Add some of the shots: their stated directions, from where the lidar truly was."""
        span = float(np.ptp(beams.times))
        stride = max(1, int(beams.times.size / (RATE_HZ * max(span, 1e-3))))
        nodes = nodes_around(beams, self.rig.lidar)
        times, far = beams.times.ravel()[::stride], ranges.ravel()[::stride]
        returned = np.isfinite(far) & (far > AIRFRAME_RANGE)
        chosen = beams.directions.reshape(-1, 3)[::stride][returned]
        origins, directions = nodes.place(times[returned], chosen)
        points = origins + directions * far[returned, None]
        self.rows.append(np.column_stack([points, times[returned]]))

    def write(self, path: Path, first: float) -> None:
        """Write x, y, z, m, in the simulated world, and the IMU's time since `first`, s: (N, 4)."""
        rows = np.vstack(self.rows) if self.rows else np.empty((0, 4))
        np.save(path, rows - [0.0, 0.0, 0.0, first])
