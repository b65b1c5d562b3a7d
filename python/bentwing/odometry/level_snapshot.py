# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a pass has registered, where its poses are level and no surfaces are kept."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.trajectory import DT
from bentwing.odometry.core_states import core_globals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory


class LevelSnapshot(ABC):
    """Fulfils `Registered` for a subclass with `end`, `windows`, `is_settling` and `calibration`."""

    calibration: Calibration

    @abstractmethod
    def recent(self) -> Trajectory:
        """Return the recent poses, level, 100 a second."""

    def level(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (N, 3) that `samples` has placed, which is level already."""
        return points

    def normals(self) -> NDArray[np.float64]:
        """Return no normals (0, 3)."""
        return np.empty((0, 3))

    @cached_property
    def samples(self) -> _core.Samples:
        """The recent poses, to place points by."""
        recent = self.recent()
        return _core.Samples(
            float(recent.times[0]), DT, recent.positions.copy(), recent.quats_xyzw.copy()
        )

    @cached_property
    def globals(self) -> _core.Globals:
        """The slow states, gravity vertical."""
        return core_globals(self.calibration)
