# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a recording does not tell of the head, as comments of YAML that say how to find it."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, get_args

from bentwing.recording.lidar_kinds import LidarKind
from bentwing.recording.messages.gps_fix import GPS_FIX
from bentwing.recording.topics import NAV_SAT_FIX

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.recording.containers.scanned import TopicInfo
    from bentwing.recording.payload import Payload
    from bentwing.recording.tf_mount import TfMount

WIDTH = 100  # columns of a comment
NOISES = {"gyro_noise", "accel_noise"}
_IDENTITY = "{translation: [0.0, 0.0, 0.0], quaternion: [0.0, 0.0, 0.0, 1.0]}"
_MOUNT = f"""\
# Where the lidar is on the IMU: its origin in the IMU frame, m, and the turn from the lidar's axes to
# the IMU's, x y z w. A drawing or a ruler will do to a few centimetres and degrees; `bentwing calibrate`
# refines it from half a minute of motion.
# T_imu_lidar: {_IDENTITY}
"""
_MOTOR = f"""\
# Into encoder: the motor on the IMU, the lidar on the motor, and the motor's axis in its own frame. A
# drawing will do to a few centimetres and degrees; `bentwing calibrate` refines it from one revolution
# at rest.
#   axis: [0.0, 0.0, 1.0]
#   T_imu_motor: {_IDENTITY}
#   T_motor_lidar: {_IDENTITY}
"""
_KIND = """\
# Into lidar: its kind, which decides ranges and noise, out of {kinds};
# or its ranges, m, and one standard deviation of a range, m, from the data sheet.
#   kind: generic
"""
_NOISE = """\
# Into imu: densities that include the vibration of the carrier, rad/s/√Hz and m/s²/√Hz. Divide the
# standard deviation of the samples in hover by the square root of their rate; the defaults are those
# of a consumer-grade IMU on a drone.
#   gyro_noise: 5.0e-4
#   accel_noise: 8.0e-4
"""
_CARRIER = """\
# The carrier, if the lidar sees it: boxes in the lidar frame, m. `bentwing info` proposes them.
# self_hits:
#   - box: {min: [-0.4, -0.4, -0.1], max: [0.4, 0.4, 0.5]}
"""
_GNSS = """\
# GNSS fixes are used only when named; the antenna's phase centre in the IMU frame, m.
# gnss: {{topic: {topic}, lever_arm: [0.0, 0.0, 0.0]}}
"""


def of(payload: Payload, topics: Sequence[TopicInfo]) -> Iterator[str]:
    """Yield what is left to say of a head."""
    if payload.lidar.kind == "generic" and "range_sigma" not in payload.lidar.differing():
        yield _KIND.format(kinds=", ".join(get_args(LidarKind)))
    if payload.encoder is not None:
        if not payload.encoder.places_motor:
            yield _MOTOR
    elif payload.describes_imu and payload.T_imu_lidar is None:
        yield _MOUNT
    if (
        payload.imu is not None
        and payload.describes_imu
        and not payload.imu.differing().keys() & NOISES
    ):
        yield _NOISE
    if not payload.self_hits:
        yield _CARRIER
    for topic in topics:
        if payload.gnss is None and topic.type in {NAV_SAT_FIX, *GPS_FIX} and topic.count:
            yield _GNSS.format(topic=topic.name)


def of_tf(mount: TfMount) -> str:
    """Return the comment on what /tf_static says of the mount, wrapped."""
    return "".join(f"# {line}\n" for line in textwrap.wrap(f"{mount.sentence}.", WIDTH))


def other_topics(role: str, names: Sequence[str]) -> str:
    """Return the comment on topics that could play a part as well."""
    return f"# Into {role}, if it is rather one of these: topic: {' or '.join(names)}\n"
