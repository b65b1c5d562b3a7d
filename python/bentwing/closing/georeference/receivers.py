# SPDX-License-Identifier: MIT OR Apache-2.0
"""The GNSS fixes that a map has: those of one recording, or of all that were merged."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.fixes import Fixes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Receivers:
    """Fixes with the antennas that they are of.

    Attributes
    ----------
    fixes : on the time line of the trajectory
    lever_arms : (N, 3) m, from the IMU to the antenna of each fix, IMU frame
    runs : (N,) which of the runs each fix is of
    names : of the runs
    lever_stds : of the runs, m, by which the lever arm may be off along each axis; zero where it is known
    """

    fixes: Fixes
    lever_arms: NDArray[np.float64]
    runs: NDArray[np.intp]
    names: tuple[str, ...]
    lever_stds: tuple[float, ...]

    @classmethod
    def one(
        cls, fixes: Fixes, lever_arm: Sequence[float], name: str = "", lever_std: float = 0.0
    ) -> Receivers:
        """Return the fixes of one recording."""
        n = len(fixes.times)
        levers = np.tile(np.asarray(lever_arm, np.float64), (n, 1))
        return cls(fixes, levers, np.zeros(n, np.intp), (name,), (lever_std,))

    @classmethod
    def joined(cls, several: Sequence[Receivers]) -> Receivers:
        """Return the fixes of several runs, whose times follow each other."""
        fixes = [one.fixes for one in several]
        counts = sum((f.counts for f in fixes), Counter[str]())
        runs = [np.full(len(f.times), i, np.intp) for i, f in enumerate(fixes)]
        return cls(
            Fixes(
                np.concatenate([f.times for f in fixes]),
                np.concatenate([f.places for f in fixes]),
                np.concatenate([f.covariances for f in fixes]),
                counts,
            ),
            np.concatenate([one.lever_arms for one in several]),
            np.concatenate(runs),
            tuple(name for one in several for name in one.names),
            tuple(std for one in several for std in one.lever_stds),
        )

    def moved(self, run: int, by: NDArray[np.float64]) -> Receivers:
        """Return them with the antenna of one run elsewhere, by (3,) m in the IMU frame."""
        return replace(self, lever_arms=self.lever_arms + np.outer(self.runs == run, by))

    def during(self, spans: Sequence[tuple[float, float]], offset: float = 0.0) -> Receivers:
        """Return those within spans of time, s, later by an offset, s."""
        fixes = self.fixes
        within = np.any([(fixes.times >= a) & (fixes.times <= b) for a, b in spans], axis=0)
        return Receivers(
            Fixes(
                fixes.times[within] + offset,
                fixes.places[within],
                fixes.covariances[within],
                fixes.counts,
            ),
            self.lever_arms[within],
            self.runs[within],
            self.names,
            self.lever_stds,
        )
