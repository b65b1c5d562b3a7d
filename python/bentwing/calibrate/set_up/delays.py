# SPDX-License-Identifier: MIT OR Apache-2.0
"""The delays that a 2D lidar may have, from what its scans show without its mount."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.calibrate.set_up.crossings import Reading
from bentwing.calibrate.set_up.returns import NEARBY, delays_by_returns

if TYPE_CHECKING:
    from bentwing.calibrate.set_up.crossings import Crossings
    from bentwing.calibrate.set_up.scans import Scans
    from bentwing.recording import ImuBatch

LIKELY = 4  # delays that are looked at more closely
# Of what scans usually differ by. A head that spins evenly looks alike at any delay, and the best
# differs by 0.02 less than none; a true delay by 0.14 and more.
TELLING = 0.07
"""By how much less scans must differ at a delay than at none for it to be believed."""


def likely_delays(scans: Scans, imu: ImuBatch, crossings: Crossings) -> list[float]:
    """Return delays, s, the likeliest first, the one of clocks that agree among the first two.

    Parameters
    ----------
    imu : rates in rad/s
    """
    seen = delays_by_returns(scans, imu)
    # A head that nods comes back after a period as well, but then its carrier has turned a little.
    likely = sorted(seen[:LIKELY], key=lambda pair: pair[0] * crossings.least(Reading(pair[1])))
    ranked = [*likely, *seen[LIKELY:]]
    none = min(ranked, key=lambda pair: abs(pair[1]), default=(float("inf"), 0.0))
    if abs(none[1]) >= NEARBY:
        none = (float("inf"), 0.0)
    others = [pair for pair in ranked if pair is not none]
    is_told = len(others) > 0 and others[0] is ranked[0] and others[0][0] < none[0] - TELLING
    ordered = [*others[:is_told], none, *others[is_told:]]
    return [delay for _, delay in ordered]
