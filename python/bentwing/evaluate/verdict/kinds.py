# SPDX-License-Identifier: MIT OR Apache-2.0
"""The kinds of evidence: what is doubtful and what has failed, in words a surveyor knows.

The bounds come from the distributions over simulated good and faulted recordings that docs/verdict.md
shows.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base.spans import name_spans

if TYPE_CHECKING:
    from bentwing.evaluate.verdict.evidence import Evidence

_NEVER = math.inf
LAST_CAUSE = 3
"""Up to this rank, evidence is about the samples themselves: no trajectory can be right with them."""


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of evidence.

    Attributes
    ----------
    rank : of several reasons the one with the lowest is said first: it is nearest to the cause
    doubtful, failed : values above make a result so
    finding : says what was found, with `value`, `percent` (a hundred values), `when` and the facts
    advice : says what to do
    """

    rank: int
    doubtful: float
    failed: float
    finding: str
    advice: str

    def sentence(self, evidence: Evidence) -> str:
        """Say what was found."""
        when = f" {name_spans(evidence.spans)}" if evidence.spans else ""
        value = evidence.value
        return self.finding.format(value=value, percent=100 * value, when=when, **evidence.facts)


_HEAD = "check payload.yaml, axes, units and clocks with `bentwing info`"

KINDS: dict[str, Kind] = {
    "units": Kind(
        0, 0.5, 0.5,
        "{problem}",
        "then map again",
    ),
    "set_up": Kind(
        0, 0.5, _NEVER,
        "{problem}",
        "then map again",
    ),
    "constant": Kind(
        0, 0.5, 0.5,
        "the {instrument} gives the same value all the time",
        "switch it on in the driver, and record again",
    ),
    "repeated": Kind(
        0, 0.05, 0.2,
        "{percent:.0f} % of the IMU's samples only repeat the one before",
        "the IMU or its driver had stopped; record again",
    ),
    "gyro_limit": Kind(
        1, 0.005, 0.05,
        "{share:.1f} % of the gyro's samples stay at the end of its range",
        "set a larger range in the IMU, or turn more slowly",
    ),
    "accelerometer_limit": Kind(
        1, 0.005, 0.05,
        "{share:.1f} % of the accelerometer's samples stay at the end of its range",
        "set a larger range in the IMU, or damp the head",
    ),
    "imu_period": Kind(
        2, 0.03, _NEVER,
        "the IMU gives {rate:.0f} samples a second, too few for a lidar that moves",
        "set the IMU to 100 Hz or more",
    ),
    "even_ranges": Kind(
        3, 50.0, 100.0,
        "all returns of the lidar have nearly the same range: it saw no surroundings",
        "check the lidar and its driver",
    ),
    "scatter": Kind(
        3, 0.2, 0.4,
        "neighbouring returns of the lidar have ranges without relation: it saw no surfaces",
        "check the lidar, its driver, and whether points and times belong together",
    ),
    "point_order": Kind(
        3, 0.2, 0.4,
        "the points of a scan are not in the order of their times: neighbouring directions show one "
        "surface, successive points do not",
        "let the driver write each point with the time at which it was measured",
    ),
    "slice": Kind(
        3, 0.95, 0.985,
        "the plane of the 2D lidar stays the same: the map is one slice of the surroundings",
        "spin or nod the lidar, or use a 2D SLAM program",
    ),
    "gravity": Kind(
        4, 0.4, 3.0,
        "the mean force of the accelerometer differs from gravity by {value:.2f} m/s²",
        "check its unit, its scale and whether the driver removes gravity",
    ),
    "matches": Kind(
        5, 4.5, 20.0,
        "{share:.0f} % of the surfaces seen again do not fit the trajectory{when}",
        _HEAD,
    ),
    "lost": Kind(
        6, 0.1, 0.25,
        "for {seconds:.0f} s{when} the lidar sees nothing that fits what it saw before",
        _HEAD,
    ),
    "unseen": Kind(
        11, 6.0, _NEVER,
        "for {value:.0f} s the surroundings show too little structure to tell where the lidar is",
        "compare the map before and after, and fly there with more structure in view",
    ),
    "loop": Kind(
        6, 0.03, 0.15,
        "{percent:.0f} % of the surfaces that were seen more than once in the whole recording do not "
        "fit together",
        _HEAD,
    ),
    "gyro": Kind(
        7, 2.0, 6.0,
        "the trajectory turns otherwise than the gyro says, by {degrees:.2f} °/s{when}",
        "check T_imu_lidar, the gyro's axes and scale, and the clocks",
    ),
    "scale": Kind(
        4, 0.03, 0.15,
        "the path is {times:.2f} times as long as the accelerometer says: the ranges of the lidar, or "
        "the accelerometer, have a wrong scale",
        "check the unit and the scale of both",
    ),
    "accelerometer": Kind(
        8, 0.8, 3.0,
        "the trajectory moves otherwise than the accelerometer says, by {force:.2f} m/s²{when}",
        "check the accelerometer's axes and scale, T_imu_lidar, and the unit of the ranges",
    ),
    "gyro_noise": Kind(
        9, 3.0, _NEVER,
        "the gyro differs from what the lidar sees by {value:.1f} times what its noise explains{when}",
        "check the gyro's axes and scale, the clocks, and gyro_noise in payload.yaml",
    ),
    "accelerometer_noise": Kind(
        9, 3.0, _NEVER,
        "the accelerometer differs from what the lidar sees by {value:.1f} times what its noise "
        "explains{when}",
        "check the accelerometer's axes and scale, the unit of the ranges, and accel_noise in "
        "payload.yaml",
    ),
    "clocks": Kind(
        9, 3e-4, _NEVER,
        "the clocks of lidar and IMU run apart by {milliseconds:.2f} ms a second",
        "synchronise them, or take the stamps of one computer",
    ),
    "calibration": Kind(
        10, 8.0, _NEVER,
        "{name} is {value:.0f} standard deviations off what payload.yaml says",
        "compare the calibration in the report with the drawing of the head, and correct payload.yaml",
    ),
    "correction": Kind(
        11, 2.0, 20.0,
        "closing the loops moved the trajectory by {moved:.2f} m, more than it usually drifts",
        "look for doubled walls in the report",
    ),
    "revisits": Kind(
        11, 2.0, 6.0,
        "surfaces seen again lie {millimetres:.0f} mm apart",
        "look for doubled walls in the report",
    ),
    "marks": Kind(
        11, 0.5, _NEVER,
        "{names} lies {metres:.2f} m from where the other surveyed marks put it{unused}",
        "check its coordinates, and where it was seen in the map",
    ),
    "joins": Kind(
        11, 0.5, _NEVER,
        "a single place joins {runs}, and no second place, no loop of runs and no fixes confirm it",
        "check the map there, or add a run that sees both at another place",
    ),
    "speed": Kind(
        12, 40.0, 80.0,
        "the trajectory reaches {value:.0f} m/s at {at:.1f} s",
        _HEAD,
    ),
    "breaks": Kind(
        13, 0.5, _NEVER,
        "the recording is interrupted{when}, and where the map goes on is a guess",
        "fly over what was seen before once more, or map the parts one by one",
    ),
}  # fmt: skip
"""By their names."""
