# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the stamps of a stream say of its clock, added up as they come."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.clocks.fit import ClockLine

LATE = 4.0
"""Times the jitter; a message later than that is late."""
NOTABLE = 5e-4
"""s; nothing is late by less."""
POOR_JITTER, POOR_SHARE, POOR_LATENESS = 1e-3, 0.005, 0.005
"""s, share and s. What is beyond is left of a host's load, and is said."""
MOST_LOST = 0.5
"""s, of a silence in which messages were lost; a longer one is a gap."""


@dataclass(slots=True)
class ClockFindings:
    """Stamps against the clock of their stream.

    Attributes
    ----------
    n : messages so far
    n_periodic : of them, those with a clock
    n_corrected : of them, those whose stamps were put where the clock says
    n_late, n_lost : messages that came late, and that did not come
    latest : s, the most that one was late
    """

    n: int = 0
    n_periodic: int = 0
    n_corrected: int = 0
    n_late: int = 0
    n_lost: int = 0
    latest: float = 0.0
    _squares: float = 0.0
    _n_usual: int = 0
    _shortest: float = np.inf
    _longest: float = 0.0

    def add(
        self,
        stamps: NDArray[np.float64],
        low: int,
        high: int,
        line: ClockLine | None,
        *,
        corrected: bool,
    ) -> None:
        """Take messages [low, high) of some stamps, s, and the line of their clock."""
        self.n += high - low
        if line is None:
            return
        numbers = line.numbers[low - line.first : high - line.first]
        residuals = stamps[low:high] - line.times(numbers)
        late = residuals > max(LATE * line.jitter, NOTABLE)
        skipped = np.diff(line.numbers[max(0, low - 1 - line.first) : high - line.first]) - 1
        self.n_periodic += high - low
        self.n_corrected += (high - low) * corrected
        self.n_late += int(late.sum())
        self.n_lost += int(skipped[skipped * line.period < MOST_LOST].sum())
        self.latest = max(self.latest, float(residuals.max()))
        self._squares += float((residuals[~late] ** 2).sum())
        self._n_usual += int((~late).sum())
        self._shortest = min(self._shortest, line.period)
        self._longest = max(self._longest, line.period)

    @property
    def period(self) -> float | None:
        """Time between messages, s; None without a clock."""
        return 0.5 * (self._shortest + self._longest) if self.n_periodic else None

    @property
    def jitter(self) -> float:
        """Standard deviation of the stamps that are not late, s."""
        return float(np.sqrt(self._squares / self._n_usual)) if self._n_usual else 0.0

    @property
    def drift(self) -> float:
        """Between the slowest and the fastest second, as a share of the period."""
        return self._longest / self._shortest - 1.0 if self.n_periodic else 0.0

    @property
    def late_share(self) -> float:
        """Share of the messages with a clock that came late."""
        return self.n_late / self.n_periodic if self.n_periodic else 0.0

    @property
    def is_poor(self) -> bool:
        """Whether the user should know."""
        is_late = self.late_share > POOR_SHARE and self.latest > POOR_LATENESS
        return self.n_corrected > 0 and (self.jitter > POOR_JITTER or is_late)

    def to_json(self) -> dict[str, Any]:
        """Return them as run.json has them, times in s."""
        return {
            "period": self.period,
            "jitter": self.jitter,
            "drift_ppm": 1e6 * self.drift,
            "late_share": self.late_share,
            "latest": self.latest,
            "lost": self.n_lost,
            "periodic_share": self.n_periodic / self.n if self.n else 0.0,
            "corrected": self.n_corrected,
        }

    def __str__(self) -> str:
        if self.period is None or 2 * self.n_periodic < self.n:
            return "not periodic, every stamp as it is"
        most = f" (at most {1e3 * self.latest:.0f} ms)" if self.n_late else ""
        return (
            f"every {1e3 * self.period:.4g} ms, jitter {1e3 * self.jitter:.2f} ms, "
            f"{self.late_share:.1%} late{most}, {self.n_lost} lost, {self.n_corrected} corrected"
        )
