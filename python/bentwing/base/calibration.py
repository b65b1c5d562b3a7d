# SPDX-License-Identifier: MIT OR Apache-2.0
"""The slow states of a sensor head: clocks, mount, biases and gravity."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.inertial_unit import InertialUnit
from bentwing.base.mount import mount_from_json
from bentwing.base.range_bias import RangeBias
from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from bentwing.base.mount import Mount

STANDARD_GRAVITY = 9.80665  # m/s²
_VECTORS = ("gyro_bias", "accel_bias", "gravity")


@dataclass(frozen=True, slots=True, eq=False)
class Calibration(Value):
    """The slow states at the end of the estimate, with their standard deviations.

    Attributes
    ----------
    latency : s, lidar stamps as they are read minus IMU clock, at `latency_epoch`
    mount : where the lidar is, seen from the IMU
    gyro_bias, accel_bias : (3,) rad/s, m/s²
    gravity : (3,) m/s², map frame, pointing up
    std : standard deviation of what was estimated, by the names `latency` (1,), `latency_rate` (1,),
        `extrinsic_rotation` (3,) rad and `extrinsic_translation` (3,) m of the lidar, or of the
        motor, in the IMU frame, `gyro_bias` (3,), `accel_bias` (3,), `gravity` (2,) rad, and for
        a motor `encoder_zero` (1,) rad, and of the lidar across the axis `motor_tilt` (2,) rad and
        `motor_offset` (2,) m; of the unit `gyro_scale` (3,), `gyro_misalignment` (3,) rad, `g_sensitivity`
        (9,) rad/s per m/s², `accel_scale` (3,) and `accel_misalignment` (6,) rad; of the ranges
        `range_offset` (1,) m and `range_grazing` (1,) rad
    latency_read : s, what was taken off the lidar's stamps when they were read
    latency_rate : s/s, how much faster than the IMU's clock the lidar's runs
    latency_epoch : s, the stamp at which the latency is `latency`
    unit : how the IMU answers beside its biases
    ranges : by how much they are too long
    """

    latency: float
    mount: Mount
    gyro_bias: NDArray[np.float64]
    accel_bias: NDArray[np.float64]
    gravity: NDArray[np.float64]
    std: dict[str, list[float]] = field(default_factory=dict)
    latency_read: float = 0.0
    latency_rate: float = 0.0
    latency_epoch: float = 0.0
    unit: InertialUnit = field(default_factory=InertialUnit)
    ranges: RangeBias = field(default_factory=RangeBias)

    def measured(self, stamps: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return when on the clock of the IMU it was that the lidar stamps so, s."""
        late = self.latency + self.latency_rate * (stamps - self.latency_epoch)
        return np.asarray(stamps - late)

    def with_epoch(self, epoch: float) -> Calibration:
        """Return the same with the latency at another stamp, s."""
        passed = self.latency_rate * (epoch - self.latency_epoch)
        return replace(self, latency=self.latency + passed, latency_epoch=epoch)

    @property
    def source_latency(self) -> float:
        """Lidar stamps as the recording has them minus IMU clock, s."""
        return self.latency + self.latency_read

    def to_json(self) -> dict[str, Any]:
        """Return the calibration as run.json has it; the mount as payload.yaml does."""
        return {
            "latency": self.source_latency,
            "latency_left": self.latency,  # a sum would lose its last digits
            "latency_read": self.latency_read,
            "latency_rate": self.latency_rate,
            "latency_epoch": self.latency_epoch,
            "mount": self.mount.to_json(),
            **{name: getattr(self, name).tolist() for name in _VECTORS},
            "unit": self.unit.to_json(),
            "ranges": self.ranges.to_json(),
            "std": self.std,
        }

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> Calibration:
        """Read the calibration in a run.json, of earlier versions as well."""
        vectors = {name: np.array(described[name], float) for name in _VECTORS}
        mount = mount_from_json(described["mount"])
        latency = described.get("latency_left", described["latency"])
        read = described.get("latency_read", 0.0)
        rate, epoch = (described.get(name, 0.0) for name in ("latency_rate", "latency_epoch"))
        return cls(
            latency,
            mount,
            **vectors,
            std=described["std"],
            latency_read=read,
            latency_rate=rate,
            latency_epoch=epoch,
            unit=InertialUnit.from_json(described.get("unit")),
            ranges=RangeBias.from_json(described.get("ranges")),
        )
