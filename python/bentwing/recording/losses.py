# SPDX-License-Identifier: MIT OR Apache-2.0
"""What of a recording could not be used, as the reason why something could not be estimated."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

_LEAST = 0.1  # of what was read; a smaller loss explains nothing
_MESSAGES = {
    "broken_messages": "could not be read",
    "broken_packets": "are none of this sensor's",
    "backwards_stamps": "have stamps going backwards",
    "duplicate_stamps": "repeat the stamp before them",
    "stamp_jumps": "have stamps that jump",
    "empty_scans": "are empty",
}
_VALUES = {
    "nan": "are not a number",
    "inf": "are infinite",
    "zero": "are zero",
    "out_of_range": "are out of range",
}
_PARTS = (
    ("lidar", "messages", "lidar messages", _MESSAGES),
    ("lidar", "returns", "lidar returns", _VALUES),
    ("imu", "messages", "IMU messages", _MESSAGES),
    ("imu", "samples", "IMU samples", _VALUES),
    ("encoder", "messages", "encoder messages", _MESSAGES),
    ("encoder", "samples", "encoder angles", _VALUES),
)


def losses(counts: Mapping[str, int]) -> list[str]:
    """Return what was left out in numbers that matter, as `812 of 812 IMU samples are not a number`.

    Parameters
    ----------
    counts : of a recording and its preprocessing, by `<stream>.<reason>`
    """
    found = []
    for stream, total, noun, reasons in _PARTS:
        lost = {reason: counts.get(f"{stream}.{reason}", 0) for reason in reasons}
        n = counts.get(f"{stream}.{total}", 0)
        if total == "messages":  # what was left out is not among those that were read
            n = (n or counts.get(f"{stream}.samples", 0)) + sum(lost.values())
        found += [
            f"{lost[reason]:,} of {n:,} {noun} {says}"
            for reason, says in reasons.items()
            if lost[reason] > _LEAST * n
        ]
    far = counts.get("preprocess.range", 0)
    if far > _LEAST * counts.get("lidar.returns", 0):
        found.append(f"{far:,} lidar returns are outside of the payload's min_range and max_range")
    return found
