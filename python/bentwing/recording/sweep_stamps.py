# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the stamps of sweeps without times of their own say: how long one lasts, and when it began."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.base.clock import NS_PER_S
from bentwing.recording.clocks.fit import fit_clock

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.recording.sections.lidar import TimeReference

Evidence = Literal["payload", "recorder", "assumed"]

WHOLE = 0.9  # of a sweep's length; a message that arrives sooner was not stamped at its beginning
CLOCK_STEP = 2e-3  # s, by which the stamps of a sensor may be ahead of the recorder's clock
MAX_DELAY = 1.0  # s; beyond it the recorder has another clock
SAME = 1e-6  # s; delays that do not even differ by it were written by a converter
SINCE: dict[TimeReference, float] = {"start": 0.0, "middle": 0.5, "end": 1.0, "absolute": 0.0}
"""What of a sweep is over at its stamp."""
WORDS = {"start": "first point", "middle": "middle", "end": "last point"}
REASONS: dict[Evidence, str] = {
    "payload": "as the payload says",
    "recorder": "as the recorder's times say",
    "assumed": "assumed; if it is another moment, lidar.time_reference in the payload says so",
}


@dataclass(frozen=True, slots=True)
class SweepStamps:
    """The stamps of the first sweeps.

    Attributes
    ----------
    stamps : (M,) s since the first one
    delays : (M,) s, by which the recorder came later; empty where the recorder's times are the stamps
    reference : by the payload, None where it says nothing
    """

    stamps: tuple[float, ...]
    delays: tuple[float, ...]
    reference: TimeReference | None = None

    @classmethod
    def of(
        cls,
        headers_ns: Sequence[int],
        recorder_ns: Sequence[int],
        reference: TimeReference | None,
    ) -> SweepStamps:
        """Return them by the stamps of headers, which may all be zero, and the recorder's."""
        has_headers = any(headers_ns)
        used = np.array(headers_ns if has_headers else recorder_ns, dtype=np.int64)
        delays = (np.array(recorder_ns, dtype=np.int64) - used) / NS_PER_S
        stamps = (used - used[0]) / NS_PER_S
        return cls(tuple(stamps.tolist()), tuple(delays.tolist()) if has_headers else (), reference)

    @property
    def period(self) -> float | None:
        """Time from sweep to sweep, s; None where there are too few of them."""
        stamps = np.array(self.stamps)
        line = fit_clock(stamps, 0, len(stamps)) if (np.diff(stamps) >= 0).all() else None
        if line is not None:
            return line.period
        steps = np.diff(stamps)
        usual = float(np.median(steps)) if len(steps) else 0.0
        if usual <= 0.0:
            return None
        numbers = np.concatenate([[0.0], np.cumsum(np.rint(steps / usual))])
        return float(np.polyfit(numbers, stamps, 1)[0]) if numbers[-1] > 0 else usual

    @property
    def spread(self) -> float:
        """What the stamps are off their period, s, one standard deviation."""
        period = self.period
        if period is None:
            return 0.0
        left = np.diff(self.stamps) % period
        left = np.minimum(left, period - left)  # of sweeps that were lost
        return float(1.4826 * np.median(left) / np.sqrt(2))

    def meaning(self, length: float) -> tuple[TimeReference, Evidence]:
        """Return which moment of a sweep its stamp tells, and how that is known.

        A message cannot arrive before its last point was measured. One that arrives less than a sweep
        after its stamp was stamped at the end.

        Parameters
        ----------
        length : s, of a sweep
        """
        if self.reference is not None and self.reference != "absolute":
            return self.reference, "payload"
        if not self.delays:
            return "end", "recorder"  # whose time is after the last point
        least, most = min(self.delays), max(self.delays)
        if most - least < SAME or not -CLOCK_STEP < least < MAX_DELAY:
            return "start", "assumed"
        return ("start" if least >= WHOLE * length else "end"), "recorder"
