# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fixed views: immovable surfels from earlier in the trajectory, like keyframes (Kaul 2015, 2.1)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.estimators.settings import ContinuousSettings

# A view seen before the payload turned holds little; one this many times richer replaces it
# without waiting for motion.
RICHER = 1.3


class FixedViews:
    """The newest views; a new one is frozen when the window's start has moved far enough."""

    def __init__(self, settings: ContinuousSettings) -> None:
        self.views: list[_core.FixedView] = []
        self._settings = settings
        self._place: NDArray[np.float64] | None = None

    def add(self, view: _core.FixedView) -> None:
        """Take a view in place of the oldest; one without surfels is passed over."""
        if len(view):
            self.views = [*self.views, view][-self._settings.n_views :]

    def update(
        self,
        surfels: Sequence[tuple[float, _core.Surfels]],
        window_start: float,
        samples: _core.Samples,
        slow: _core.Globals,
    ) -> None:
        """Freeze the last `view_length` seconds before the window, if it is time to."""
        start = window_start - self._settings.view_length
        left = [s for t, s in surfels if t < window_start]
        if not left or self._settings.n_views == 0 or start < samples.start:
            return
        place = samples.position_at(window_start)
        moved = self._place is None or np.linalg.norm(place - self._place) >= self._settings.view_distance
        n_left = sum(int(((s.stamps >= start) & (s.stamps < window_start)).sum()) for s in left)
        poorest = min((len(v) for v in self.views), default=0)
        if not moved and n_left < RICHER * poorest:
            return
        self.add(_core.FixedView(left, start, window_start, samples, slow))
        self._place = place
