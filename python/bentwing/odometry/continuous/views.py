# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fixed views: surfels of final poses from earlier on, like keyframes (Kaul 2015, section 2.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.odometry.continuous.settings import ContinuousSettings

# A view seen before the payload turned holds little; one this many times richer follows it
# without waiting for motion.
RICHER = 1.3
# Views that are still known; more hold drift down over longer loops, for a megabyte each.
MAX_POOL = 48
# Of the views that take part so many are the newest; the others are those of the nearest places.
N_NEWEST = 3


@dataclass(frozen=True, slots=True)
class _View:
    surfels: _core.FixedView
    place: NDArray[np.float64]


class FixedViews:
    """Views along the way; a new one is frozen when the window's start has moved far enough."""

    def __init__(self, settings: ContinuousSettings) -> None:
        self._pool: list[_View] = []
        self._settings = settings
        self._place: NDArray[np.float64] | None = None
        # Where the newest view ends, s.
        self._stop = -np.inf

    def add(self, view: _core.FixedView, place: NDArray[np.float64]) -> None:
        """Take a view in place of the oldest; one without surfels is passed over."""
        if len(view):
            self._pool = [*self._pool, _View(view, place)][-MAX_POOL:]

    def around(self, place: NDArray[np.float64]) -> list[_core.FixedView]:
        """Return the newest views, and of the others those from nearest to `place` (3,)."""
        n_newest = min(N_NEWEST, self._settings.n_views)
        split = max(0, len(self._pool) - n_newest)
        others = sorted(self._pool[:split], key=lambda v: float(np.linalg.norm(v.place - place)))
        chosen = others[: self._settings.n_views - n_newest] + self._pool[split:]
        return [v.surfels for v in chosen]

    def update(
        self,
        surfels: Sequence[tuple[float, _core.Surfels]],
        window_start: float,
        samples: _core.Samples,
        slow: _core.Globals,
    ) -> None:
        """Freeze the last `view_length` seconds before the window, if it is time to.

        Views follow each other without overlap: at 15 m/s each metre would be in several of the
        newest ones, and together they would reach back no farther than one of them.
        """
        start = window_start - self._settings.view_length
        left = [s for t, s in surfels if t < window_start]
        if not left or self._settings.n_views == 0 or start < samples.start:
            return
        place = samples.position_at(window_start)
        moved = self._place is None or (
            start >= self._stop - 1e-6
            and np.linalg.norm(place - self._place) >= self._settings.view_distance
        )
        n_left = sum(int(((s.stamps >= start) & (s.stamps < window_start)).sum()) for s in left)
        poorest = min((len(v.surfels) for v in self._pool[-N_NEWEST:]), default=0)
        if not moved and n_left < RICHER * poorest:
            return
        self.add(_core.FixedView(left, start, window_start, samples, slow), place)
        self._place, self._stop = place, window_start
