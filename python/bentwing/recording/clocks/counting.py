# SPDX-License-Identifier: MIT OR Apache-2.0
"""Number the messages of a periodic sensor by the periods that have passed, those lost included."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

REACH = 8
"""Messages across which the first guess of the period is taken: jitter averages, few are lost."""
EARLIEST = 0.5
"""Periods by which a message may at most be earlier than the punctual ones."""


def usual_period(stamps: Array) -> float:
    """Return the usual time between messages with stamps (N,), N > `REACH`, from few of them each.

    A step alone says little where jitter is as large as the period.
    """
    return float(np.median(stamps[REACH:] - stamps[:-REACH])) / REACH


def counts(stamps: Array, punctual: float, period: float, early: float) -> NDArray[np.int64]:
    """Return how many periods after `punctual` each message was sent.

    A message may come late, but none comes before it is sent, and they keep their order. So as many
    are lost as the most punctual message from there on says: a late one says too many, and what comes
    after it says so.

    Parameters
    ----------
    stamps : (N,) s, in order
    punctual : s, when a punctual message with the number 0 arrives
    period : s
    early : s, by which a message may be earlier than a punctual one

    Returns
    -------
    (N,) strictly increasing
    """
    order = np.arange(len(stamps))
    margin = min(early / period, EARLIEST)
    lost = np.floor((stamps - punctual) / period + margin).astype(np.int64) - order
    return np.asarray(np.minimum.accumulate(lost[::-1])[::-1] + order)
