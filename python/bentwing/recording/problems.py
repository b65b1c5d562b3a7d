# SPDX-License-Identifier: MIT OR Apache-2.0
"""Sentences on what a recording lacks for mapping, each with what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.clock import NS_PER_S
from bentwing.recording.messages.lidar_messages import is_planar

if TYPE_CHECKING:
    from bentwing.recording.clocks.rates import ClockRate
    from bentwing.recording.peek import Peek

MAX_CLOCK_OFFSET = 10.0  # s between the sensors' clocks; more and they do not share one


def mount(imu_topic: str, *, turned: bool) -> str:
    """Return the sentence on an IMU whose place relative to the lidar is not known."""
    where, pose = "the lidar is on it", "T_imu_lidar"
    if turned:
        where, pose = "the motor that turns the lidar is on it", "encoder.T_imu_motor"
    return (
        f"the recording has an IMU ({imu_topic}), but the payload does not say where {where}: give "
        f"{pose} (translation in m, quaternion x y z w), or 'imu: null' to map with the lidar alone"
    )


def point_times(lidar_topic: str, lidar_type: str, lack: str) -> str:
    """Return the sentence on a lidar that does not tell when each point was measured.

    Parameters
    ----------
    lack : why the times cannot be made either
    """
    if is_planar(lidar_type):
        return (
            f"{lidar_topic}: no time per beam (time_increment is 0), and none can be made of the angles "
            f"({lack}), so a moving scan cannot be undistorted; set time_increment (time per turn / "
            "beams per turn) in the lidar's driver and record again"
        )
    return (
        f"{lidar_topic}: no time per point (no field t, time or timestamp that varies within a "
        f"cloud), and none can be made of the azimuths ({lack}), so a moving sweep cannot be "
        "undistorted; if another field has the times, name it in the payload with 'lidar: {time_field: "
        "...}', else switch them on in the lidar's driver and record again"
    )


def share_clock(lidar: Peek, other: Peek) -> bool:
    """Whether two sensors are stamped by one clock, as far as the recorder's times tell."""
    return abs(other.offset_ns - lidar.offset_ns) <= MAX_CLOCK_OFFSET * NS_PER_S


def clocks(lidar: Peek, other: Peek, section: str, offset: float) -> str | None:
    """Return the sentence on two sensors stamped by different clocks, None if they share one.

    Parameters
    ----------
    section : of the payload that describes the other
    offset : s, what it adds to the stamps already
    """
    if share_clock(lidar, other):
        return None
    difference = (other.offset_ns - lidar.offset_ns) / NS_PER_S
    return (
        f"{other.topic.name} and {lidar.topic.name} are stamped by clocks {difference:+.1f} s "
        f"apart; say so in the payload with '{section}: {{clock_offset: {offset - difference:.3f}}}', or "
        "let both drivers stamp with the host's clock and record again"
    )


def clock_rates(lidar: ClockRate, imu: ClockRate) -> str:
    """Return the sentence on two sensors of which one has a clock that runs fast or slow."""
    right, wrong = sorted((lidar, imu), key=lambda rate: abs(rate.gain))
    off = 1e3 * (wrong.gain - right.gain)
    return (
        f"the clock of {wrong.topic} {'gains' if off > 0 else 'loses'} {abs(off):.1f} ms a second on that of "
        f"{right.topic}, by the recorder's times, so that they fit at one moment only; let both drivers stamp with "
        "the host's clock, or set the sensors' clocks by PTP or GPS, and record again"
    )
