# SPDX-License-Identifier: MIT OR Apache-2.0
"""The one conversion between int64 nanoseconds at the edge and float64 seconds inside."""

from __future__ import annotations

from dataclasses import dataclass
from decimal import Decimal
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

NS_PER_S = 1_000_000_000


@dataclass(frozen=True, slots=True)
class Clock:
    """Seconds since `start_ns`, the recording's start (int ns UTC as in the source).

    Relative float64 seconds resolve 15 ps after a day; absolute ones only 238 ns, so absolute
    stamps exist as integers and as text, never as floats.
    """

    start_ns: int

    def to_seconds(self, stamps_ns: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return seconds since the start for absolute stamps in ns, any shape."""
        relative_ns = np.asarray(stamps_ns, dtype=np.int64) - self.start_ns
        return np.asarray(relative_ns / NS_PER_S, dtype=np.float64)

    def to_ns(self, times: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return absolute stamps in ns for seconds since the start, any shape."""
        return self.start_ns + np.rint(np.asarray(times) * NS_PER_S).astype(np.int64)

    def to_absolute_text(self, times: NDArray[np.float64]) -> list[str]:
        """Return absolute seconds with nine exact decimals, as trajectory files want them."""
        return [format_ns(int(stamp_ns)) for stamp_ns in self.to_ns(np.atleast_1d(times))]


def to_ns(seconds: float) -> int:
    """Return a duration as written in whole ns, also one that a product with 1e9 would round."""
    return round(Decimal(repr(float(seconds))) * NS_PER_S)


def format_ns(stamp_ns: int) -> str:
    """Return ns as seconds in decimal notation without rounding: 1500000000 → '1.500000000'."""
    sign = "-" if stamp_ns < 0 else ""
    seconds, rest_ns = divmod(abs(stamp_ns), NS_PER_S)
    return f"{sign}{seconds}.{rest_ns:09d}"
