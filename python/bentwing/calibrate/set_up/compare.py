# SPDX-License-Identifier: MIT OR Apache-2.0
"""In what a description that was found differs from the one that was given, as sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.calibrate.set_up import axes, edits
from bentwing.calibrate.set_up.set_up import Finding

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from bentwing.recording import Payload
    from bentwing.recording.sections.encoder import Encoder
    from bentwing.recording.sections.imu import Imu

# Less than this the estimator corrects by itself: s, rad.
SMALL_LATENCY, SMALL_TURN = 0.01, np.radians(3.0)
_AXIS_NAMES = ("x", "y", "z")


def findings_between(given: Payload, found: Payload) -> tuple[Finding, ...]:
    """Return in what `found` differs from `given`, for a user of the latter."""
    return (
        *_of_lidar(given, found),
        *_of_imu(given, found),
        *_of_encoder(given, found),
        *_of_mount(given, found),
    )


def _of_lidar(given: Payload, found: Payload) -> Iterator[Finding]:
    if given.lidar.range_scale != found.lidar.range_scale:
        scale = found.lidar.range_scale
        unit = {1.0: "metres", 1e-3: "millimetres"}.get(scale, f"units of {scale:g} m")
        yield Finding(
            "ranges", f"the lidar's ranges are in {unit}", f"lidar: {{range_scale: {scale:g}}}"
        )
    if given.lidar.mirrored != found.lidar.mirrored:
        way = "against" if found.lidar.mirrored else "with"
        yield Finding(
            "mirrored",
            f"the lidar's scans run {way} the sense of its points: what it sees is mirrored",
            f"lidar: {{mirrored: {str(found.lidar.mirrored).lower()}}}",
        )
    change = found.lidar.latency - given.lidar.latency
    if abs(change) > SMALL_LATENCY:
        yield Finding(
            "latency",
            f"the lidar's stamps are {1e3 * found.lidar.latency:+.0f} ms from the IMU's clock, the "
            f"payload says {1e3 * given.lidar.latency:+.0f} ms",
            f"lidar: {{latency: {found.lidar.latency:.4f}}}",
        )


def _of_imu(given: Payload, found: Payload) -> Iterator[Finding]:
    before, after = given.imu, found.imu
    if after is None or before is None:
        return
    if (offset := after.clock_offset) != before.clock_offset:
        yield Finding(
            "clock",
            f"the IMU's clock is {-offset:+.3f} s from the lidar's",
            f"imu: {{clock_offset: {offset:.6f}}}",
        )
    yield from _of_units(before, after)
    if (before.axes, before.gyro_axes) != (after.axes, after.gyro_axes):
        yield _of_axes(after)


def _of_units(before: Imu, after: Imu) -> Iterator[Finding]:
    if before.units.accel != after.units.accel:
        unit = after.units.accel
        yield Finding(
            "units", f"the accelerations are in {unit}", f"imu: {{units: {{accel: {unit}}}}}"
        )
    if before.units.gyro != after.units.gyro:
        rates = after.units.gyro
        yield Finding(
            "units", f"the angular rates are in {rates}", f"imu: {{units: {{gyro: {rates}}}}}"
        )


def _of_axes(imu: Imu) -> Finding:
    listed = f"[{', '.join(imu.axes)}]"
    if imu.gyro_axes is None:
        hand = np.linalg.det(axes.of(imu.axes))
        which = "left-handed" if hand < 0.0 else "named otherwise"
        return Finding(
            "axes",
            f"the axes of the IMU are {which}: x y z are {listed}",
            f"imu: {{axes: {listed}}}",
        )
    own = f"[{', '.join(imu.gyro_axes)}]"
    if imu.axes == ("x", "y", "z"):
        sentence = f"the axes of the gyro do not fit the accelerometer's: its x y z are {own}"
    else:
        sentence = f"the axes of the accelerometer do not fit the gyro's: its x y z are {listed}"
    return Finding("axes", sentence, f"imu: {{axes: {listed}, gyro_axes: {own}}}")


def _of_encoder(given: Payload, found: Payload) -> Iterator[Finding]:
    before, after = given.encoder, found.encoder
    if before is None or after is None:
        return
    yield from _of_joint(before, after)
    turned = axes.angle_between(_turn(before), _turn(after))
    if before.axis != after.axis:
        named = ", ".join(f"{x:.3f}" for x in after.axis)
        yield Finding(
            "encoder",
            f"the motor turns about ({named}) of its frame",
            f"encoder: {{axis: [{named}]}}",
        )
    elif abs(after.zero - before.zero) > SMALL_TURN:
        zero = after.zero
        yield Finding(
            "encoder",
            f"the encoder's zero is {np.degrees(zero - before.zero):+.1f}° from what the payload says",
            f"encoder: {{zero: {zero:.4f}}}",
        )
    elif turned > SMALL_TURN:
        quat = ", ".join(f"{x:.6f}" for x in after.T_imu_motor.quaternion)
        yield Finding(
            "mount",
            f"the motor is turned by {np.degrees(turned):.0f}° from what the payload says",
            f"encoder: {{T_imu_motor: {{quaternion: [{quat}]}}}}",
        )


def _turn(encoder: Encoder) -> NDArray[np.float64]:
    return encoder.T_imu_motor.pose.R


def _of_joint(before: Encoder, after: Encoder) -> Iterator[Finding]:
    if before.joint != after.joint:
        yield Finding(
            "encoder",
            f"the joint that turns the lidar is {after.joint}",
            f"encoder: {{joint: {after.joint}}}",
        )
    if before.unit != after.unit:
        name = "degrees" if after.unit == "deg" else "radians"
        yield Finding(
            "encoder", f"the encoder's angles are in {name}", f"encoder: {{unit: {after.unit}}}"
        )
    if before.sign != after.sign:
        yield Finding(
            "encoder",
            "the encoder's angles grow against the turn of the motor's axis",
            f"encoder: {{sign: {after.sign}}}",
        )


def _of_mount(given: Payload, found: Payload) -> Iterator[Finding]:
    if found.encoder is not None or found.T_imu_lidar is None:
        return
    R = edits.described_rotation(given)
    quat = ", ".join(f"{x:.6f}" for x in found.T_imu_lidar.quaternion)
    line = f"T_imu_lidar: {{translation: {[round(x, 4) for x in found.T_imu_lidar.translation]}, quaternion: [{quat}]}}"
    after = found.T_imu_lidar.pose.R
    if R is None:
        yield Finding("mount", f"the lidar is mounted {_described(after)} on the IMU", line)
    elif (turned := axes.angle_between(R, after)) > SMALL_TURN:
        yield Finding(
            "mount",
            f"the lidar is turned by {np.degrees(turned):.0f}° about {_axis(R.T @ after)} of its frame "
            "from what the payload says",
            line,
        )


def _described(R: NDArray[np.float64]) -> str:
    """Name a rotation (3, 3) by what its axes are."""
    square = axes.nearest(R)
    if axes.angle_between(square, R) < SMALL_TURN:
        if np.array_equal(square, np.eye(3)):
            return "straight"
        return "with its axes x y z along " + ", ".join(axes.named(square.T))
    return f"turned by {np.degrees(axes.angle_between(np.eye(3), R)):.0f}° about {_axis(R)}"


def _axis(turn: NDArray[np.float64]) -> str:
    vector = geometry.log(geometry.from_matrices(turn[None])).reshape(3)
    direction = vector / max(float(np.linalg.norm(vector)), 1e-12)
    largest = int(np.argmax(np.abs(direction)))
    if abs(direction[largest]) > np.cos(SMALL_TURN):
        return _AXIS_NAMES[largest]
    return "(" + ", ".join(f"{x:.2f}" for x in direction) + ")"
