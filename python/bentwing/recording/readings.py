# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the payload says of the samples as drivers give them: units, axes, signs and clocks.

Recordings and live inputs go through these. The readings of a payload that says nothing of it leave
every sample as it is, bit for bit.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.clock import to_ns
from bentwing.recording.beam_reading import BeamReading
from bentwing.recording.messages import wire
from bentwing.recording.point_times import NOTHING_GIVEN, GivenTimes
from bentwing.recording.tf_joint import TfJoint

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.batches import LidarBatch
    from bentwing.recording.payload import Payload
    from bentwing.recording.sections.encoder import Encoder
    from bentwing.recording.sections.imu import AccelUnit, Axes, GyroUnit, Imu
    from bentwing.recording.sections.lidar import Lidar

    Array = NDArray[np.float64]

ACCEL_FACTORS: dict[AccelUnit, float] = {
    "m/s2": 1.0,
    "g": STANDARD_GRAVITY,
    "milli-g": 1e-3 * STANDARD_GRAVITY,
    "cm/s2": 0.01,
}
DEGREE = np.pi / 180
GYRO_FACTORS: dict[GyroUnit, float] = {"rad/s": 1.0, "deg/s": DEGREE}


@dataclass(frozen=True, slots=True)
class VectorReading:
    """How vectors are read, axis by axis.

    Attributes
    ----------
    sources : which component of a sample each axis x y z is
    factors : its factor, with the sign
    """

    sources: tuple[int, ...] = (0, 1, 2)
    factors: tuple[float, ...] = (1.0, 1.0, 1.0)

    @classmethod
    def of(cls, axes: Axes, factor: float) -> VectorReading:
        """Return the reading by named axes, in a unit of `factor`."""
        signs = [-factor if axis.startswith("-") else factor for axis in axes]
        return cls(tuple("xyz".index(axis[-1]) for axis in axes), tuple(signs))

    def vectors(self, samples: Array) -> Array:
        """Return vectors (M, 3), the samples themselves where they are read as they are."""
        if self == _AS_GIVEN:
            return samples
        return np.ascontiguousarray(samples[:, list(self.sources)] * self.factors)


_AS_GIVEN = VectorReading()


@dataclass(frozen=True, slots=True)
class LidarReading:
    """How points are read.

    Attributes
    ----------
    range_scale : m per unit of the recording
    is_mirrored : y is negated
    beams : what is added to each return by its beam, if anything is
    offset_ns : added to the stamps
    times : what the payload says of the points' times
    """

    range_scale: float = 1.0
    is_mirrored: bool = False
    beams: BeamReading | None = None
    offset_ns: int = 0
    times: GivenTimes = NOTHING_GIVEN

    @classmethod
    def of(cls, lidar: Lidar) -> LidarReading:
        """Return the reading that the payload describes."""
        beams = None if lidar.beams is None else BeamReading(lidar.beams)
        return cls(
            lidar.range_scale,
            lidar.mirrored,
            beams,
            -to_ns(lidar.latency_read),
            GivenTimes.of(lidar),
        )

    def batch(self, batch: LidarBatch) -> LidarBatch:
        """Return a batch with its points in m, lidar frame."""
        points = self._in_metres(batch.points)
        if self.beams is not None:
            points = self.beams.points(points, batch.ring)
        return batch if points is batch.points else replace(batch, points=points)

    def _in_metres(self, points: Array) -> Array:
        scales = np.full(3, self.range_scale)
        if self.is_mirrored:
            scales[1] *= -1.0
        return points if (scales == 1.0).all() else points * scales


@dataclass(frozen=True, slots=True)
class ImuReading:
    """How inertial samples are read.

    Attributes
    ----------
    gyro, accel : take a sample to the imu frame, rad/s and m/s²
    offset_ns : added to the stamps
    """

    gyro: VectorReading = _AS_GIVEN
    accel: VectorReading = _AS_GIVEN
    offset_ns: int = 0

    @classmethod
    def of(cls, imu: Imu | None) -> ImuReading:
        """Return the reading that the payload describes."""
        if imu is None:
            return cls()
        gyro_axes = imu.axes if imu.gyro_axes is None else imu.gyro_axes
        return cls(
            VectorReading.of(gyro_axes, GYRO_FACTORS[imu.units.gyro]),
            VectorReading.of(imu.axes, ACCEL_FACTORS[imu.units.accel]),
            to_ns(imu.clock_offset),
        )


@dataclass(frozen=True, slots=True)
class EncoderReading:
    """How angles of the motor are read.

    Attributes
    ----------
    joint : which one of a message; None: the first
    tf : the joint of /tf that is read instead, if it is
    scale : rad per unit of the recording, with the sign
    offset_ns : added to the stamps
    """

    joint: str | None = None
    tf: TfJoint | None = None
    scale: float = 1.0
    offset_ns: int = 0

    @classmethod
    def of(cls, encoder: Encoder | None, lidar: Lidar) -> EncoderReading:
        """Return the reading that the payload describes; the encoder is on the lidar's clock."""
        if encoder is None:
            return cls()
        unit = DEGREE if encoder.unit == "deg" else 1.0
        offset_ns = to_ns(encoder.clock_offset) - to_ns(lidar.latency_read)
        return cls(encoder.joint, TfJoint.of(encoder), encoder.sign * unit, offset_ns)

    def read(self, raw: bytes, *, cdr: bool) -> tuple[int, float | None]:
        """Return stamp, ns, and position of the joint in a message, None where it does not have it.

        Raises
        ------
        BrokenMessageError
            It cannot be read.
        """
        if self.tf is not None:
            return self.tf.read(raw, cdr=cdr)
        header_ns, joints = wire.joints(raw, cdr=cdr)
        return header_ns, joints.position(self.joint)

    def angles(self, positions: Array) -> Array:
        """Return angles (K,), rad, about the payload's axis."""
        return positions if self.scale == 1.0 else positions * self.scale


@dataclass(frozen=True, slots=True)
class Readings:
    """How the samples of all sensors are read."""

    lidar: LidarReading
    imu: ImuReading
    encoder: EncoderReading

    @classmethod
    def of(cls, payload: Payload) -> Readings:
        """Return the readings that the payload describes."""
        return cls(
            LidarReading.of(payload.lidar),
            ImuReading.of(payload.imu),
            EncoderReading.of(payload.encoder, payload.lidar),
        )
