# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which points to leave out where they come faster than they are registered."""

from __future__ import annotations

# Up to this share of the largest lag everything is taken.
EASY = 2 / 3


class Backlog:
    """Takes fewer and fewer scans as the lag grows, evenly: a gap would lose the surroundings.

    Parameters
    ----------
    max_lag : s, nothing is taken beyond
    """

    def __init__(self, max_lag: float) -> None:
        self._max_lag = max_lag
        self._taken_until = -float("inf")
        self._credit = 0.0

    def has_time(self, end: float, registered: float, shift: float) -> bool:
        """Return whether to take a batch.

        Parameters
        ----------
        end : s, its last stamp
        registered : s, end of the last window
        shift : s, new data per window
        """
        self._credit += self._share((end - registered) / self._max_lag)
        # The next window cannot end before there are points beyond its end.
        starved = self._taken_until < registered + shift
        if self._credit < 1.0 and not starved:
            return False
        self._credit = max(self._credit - 1.0, 0.0)
        self._taken_until = end
        return True

    @staticmethod
    def _share(lag: float) -> float:
        return min(max((1.0 - lag) / (1.0 - EASY), 0.0), 1.0)
