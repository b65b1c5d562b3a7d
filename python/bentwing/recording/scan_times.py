# SPDX-License-Identifier: MIT OR Apache-2.0
"""The time of each beam of a 2D lidar: where its scans do not have it, from the turn of the mirror."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.sweep_stamps import REASONS, SINCE, WORDS

if TYPE_CHECKING:
    from bentwing.recording.messages.wire_scans import RawScan
    from bentwing.recording.sections.lidar import TimeReference
    from bentwing.recording.sweep_stamps import Evidence, SweepStamps

TURN = 2 * np.pi
AGREES = 0.1  # by which the period may differ from whole multiples of the scan time
PERIODS = 0.002, 1.0  # s, of scans that one turn can last


@dataclass(frozen=True, slots=True)
class ScanReading:
    """How the beams of a scan get their times.

    Attributes
    ----------
    turn : s, of the mirror, for scans whose `time_increment` is 0; None: these have no times
    reference, evidence : which moment of a scan its stamp tells, and how that is known
    first : s, of the first beam after the stamp
    error : s, likely, of the time of a beam against others
    is_said : by the scans' own `scan_time`, not by the stamps alone
    """

    turn: float | None
    reference: TimeReference = "start"
    evidence: Evidence = "payload"
    first: float = 0.0
    error: float = 0.0
    is_said: bool = False

    @classmethod
    def of(cls, scan: RawScan, reference: TimeReference) -> ScanReading:
        """Return the reading of scans that have times, and whose stamps mean what the payload says."""
        found = cls(None, reference)
        return replace(found, first=found.start(scan))

    def __str__(self) -> str:
        turn = self.turn or 0.0
        said = "scan_time" if self.is_said else "the stamps"
        return (
            f"time per beam made from the angle, as time_increment is 0: one turn of {1e3 * turn:.2f} ms by "
            f"{said}, the beams in the order of the message; the stamp is taken for that of a scan's "
            f"{WORDS[self.reference]} ({REASONS[self.evidence]}); likely error {1e3 * self.error:.2g} ms"
        )

    def increment(self, scan: RawScan) -> float:
        """Return the time from beam to beam, s."""
        if scan.time_increment != 0.0 or self.turn is None:
            return scan.time_increment
        return self.turn * abs(scan.angle_increment) / TURN

    def start(self, scan: RawScan) -> float:
        """Return the time of the first beam after the stamp, s."""
        return -SINCE[self.reference] * self.increment(scan) * max(0, len(scan.ranges) - 1)


def find_scan_turn(scan: RawScan, stamps: SweepStamps) -> ScanReading | str:
    """Return how beams without times get them, or why they cannot."""
    period = stamps.period
    if scan.angle_increment == 0.0:
        return "the scans do not say the angle from beam to beam"
    if period is None or not PERIODS[0] <= period <= PERIODS[1]:
        return "there are too few scans at a steady rate"
    is_said = _is_whole(period, scan.scan_time)
    turn = scan.scan_time if is_said else period
    length = turn * abs(scan.angle_increment) / TURN * (len(scan.ranges) - 1)
    if length > turn * (1 + AGREES):
        return "a scan goes round more than once"
    reference, evidence = stamps.meaning(length)
    return ScanReading(
        turn,
        reference,
        evidence,
        first=-SINCE[reference] * length,
        error=stamps.spread,
        is_said=is_said,
    )


def _is_whole(period: float, scan_time: float) -> bool:
    """Whether the scans that are sent are every one, or every second, third … of the lidar's."""
    if not PERIODS[0] <= scan_time <= PERIODS[1]:
        return False
    n = period / scan_time
    return bool(abs(n - max(1.0, np.rint(n))) <= AGREES)
