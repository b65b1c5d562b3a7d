# SPDX-License-Identifier: MIT OR Apache-2.0
"""Mounts that payload.yaml gives wrongly; of a turned lidar, the mount of its motor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import UsageError
from bentwing.simulate.faults.fault import Changes, Fault, Subject

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.simulate.names import FaultName

CAUSE = r"mount|T_imu_lidar|T_imu_motor|T_motor_lidar|lidar (is|sits) turned|quaternion"
TILT = np.radians(20.0), np.radians(30.0)


def _poses(payload: dict[str, Any]) -> list[dict[str, Any]]:
    """Return all poses of the payload; the first one is relative to the IMU."""
    if "encoder" in payload:
        return [payload["encoder"]["T_imu_motor"], payload["encoder"]["T_motor_lidar"]]
    if "T_imu_lidar" not in payload:
        msg = "the payload has no T_imu_lidar that this fault could change"
        raise UsageError(msg)
    return [payload["T_imu_lidar"]]


def _turned(draw: Callable[[np.random.Generator], NDArray[np.float64]]) -> Any:  # noqa: ANN401
    """Turn the mount in the IMU's frame by a rotation vector, rad, that is drawn."""

    def change(subject: Subject) -> Changes:
        turn = geometry.exp(draw(subject.rng))

        def payload(content: dict[str, Any]) -> None:
            pose = _poses(content)[0]
            turned = geometry.multiply(turn, np.array(pose["quaternion"]))
            pose["quaternion"] = [round(float(value), 12) for value in turned]

        return Changes(payload=payload)

    return change


def _reordered(_: Subject) -> Changes:
    def payload(content: dict[str, Any]) -> None:
        for pose in _poses(content):
            x, y, z, w = pose["quaternion"]
            pose["quaternion"] = [w, x, y, z]

    return Changes(payload=payload)


def _tilt(rng: np.random.Generator) -> NDArray[np.float64]:
    return rng.uniform(*TILT) * _direction(rng)


def _anywhere(rng: np.random.Generator) -> NDArray[np.float64]:
    """Draw a rotation evenly from all there are (Shoemake 1992: an even point of the 3-sphere)."""
    quaternion = rng.normal(size=4)
    return geometry.log(quaternion / np.linalg.norm(quaternion))


def _direction(rng: np.random.Generator) -> NDArray[np.float64]:
    vector = rng.normal(size=3)
    unit: NDArray[np.float64] = vector / np.linalg.norm(vector)
    return unit


def _square(degrees: int, axis: str) -> Fault:
    vector = np.radians(degrees) * np.eye(3)["xyz".index(axis)]
    return Fault(
        cast("FaultName", f"mount-{degrees}-{axis}"),
        f"The payload has the mount turned by {degrees}° about the IMU's {axis}.",
        _turned(lambda _: vector),
        "mount",
        CAUSE,
    )


FAULTS = (
    *(_square(degrees, axis) for degrees in (90, 180) for axis in "xyz"),
    Fault(
        "mount-wxyz",
        "The payload has the quaternions in the order w x y z.",
        _reordered,
        "mount",
        CAUSE,
    ),
    Fault(
        "mount-tilted",
        "The payload has the mount turned by 20 to 30° about some axis.",
        _turned(_tilt),
        "mount",
        CAUSE,
    ),
    Fault(
        "mount-random",
        "The payload has the mount turned by any rotation.",
        _turned(_anywhere),
        "mount",
        CAUSE,
    ),
)
