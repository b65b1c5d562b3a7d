# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find how a head is set up from its recording, starting from what the payload says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.compare import findings_between
from bentwing.calibrate.set_up.errors import DefectError, NotFoundError
from bentwing.calibrate.set_up.motor import UNITS, describe_motor, zero_between
from bentwing.calibrate.set_up.noise import states_noise, with_at_least
from bentwing.calibrate.set_up.planar import describe_by_trials
from bentwing.calibrate.set_up.refine import Refinement
from bentwing.calibrate.set_up.set_up import Finding, SetUp
from bentwing.calibrate.set_up.signals import Averages
from bentwing.calibrate.set_up.spatial import describe_by_motion, followed
from bentwing.calibrate.set_up.stretch import read_stretch
from bentwing.calibrate.set_up.units import with_imu_units, with_range_unit
from bentwing.odometry.imu_noise import ImuNoise
from bentwing.odometry.planar import is_plane
from bentwing.recording import EncoderBatch, Recording

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.calibrate.set_up.motor import Joint
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.recording import ImuBatch, Payload

TURNING = 0.1  # rad/s, more than the bias of any gyro
LEAST_TURNING, STEP = 2.0, 0.5  # s, and s over which rates are averaged
BELIEVED = Finding(
    "mirrored",
    "without a payload a lidar cannot be told from its mirror image with a negated accelerometer: both are "
    "taken as they are, so compare a room with the map",
    "lidar: {mirrored: false}",
)
LOOKED_AT = 5000  # points that tell a 2D lidar from a 3D one


def find_set_up(
    paths: Sequence[Path], payload: Payload, threads: int | None = None, *, after: float = 0.0
) -> SetUp:
    """Return the head as its recording shows it.

    Parameters
    ----------
    paths : consecutive parts of one recording
    payload : the description to begin with; what holds of it is kept
    after : s from the beginning of the recording that are not looked at

    Returns
    -------
    With a doubt where it could not be found, or where what was found does not hold; the payload is
    then the one given.

    Raises
    ------
    RecordingError
        The recording cannot be read.
    """
    try:
        search = _Search(paths, payload, after, threads)
        found = search.found()
    except NotFoundError as error:
        return SetUp(payload, doubt=str(error), is_defect=isinstance(error, DefectError))
    findings = findings_between(payload, found)
    if search.believes_the_hand:
        findings = (*findings, BELIEVED)
    return SetUp(found if findings else payload, findings)


class _Search:
    """Goes from what drivers give to a description of the head.

    Parameters
    ----------
    paths, payload, after, threads : as of `find_set_up`
    """

    def __init__(
        self, paths: Sequence[Path], payload: Payload, after: float, threads: int | None
    ) -> None:
        self._paths, self._threads = paths, threads
        self._given = payload
        self._has_mount = payload.places_lidar_on_imu
        self._start = edits.as_given(payload)
        with Recording(paths, self._start, strict=False) as recording:
            self._start = _with_clocks(recording, self._start)
        with Recording(paths, self._start, strict=False) as recording:
            self._stretch = read_stretch(recording, after)
            self._imu = recording.imu_topic
            self._encoder = None if payload.encoder is None else recording.encoder_topic
            self._clocks = recording.clock_rate_problem()

    @property
    def believes_the_hand(self) -> bool:
        """Whether the mirror image of the head would explain the recording as well."""
        return self._imu is not None and not self._has_mount

    def found(self) -> Payload:
        """Return the payload with all that was found."""
        if self._clocks is not None:
            raise DefectError(self._clocks)
        points = self._stretch.lidar.points
        if not len(points):
            msg = "the lidar has no return in the part with motion: check that it was not covered"
            raise NotFoundError(msg)
        start = with_range_unit(self._start, points)
        if self._imu is None:
            return self._turned(start)[0]
        start = with_imu_units(start, self._stretch.imu, self._imu)
        imu = self._stretch.read_as(start).imu
        _require_motion(imu)
        if not self._has_mount and not states_noise(start):
            start = with_at_least(start, ImuNoise.of(imu))
        if is_plane(points[:: max(1, len(points) // LOOKED_AT)]):
            return self._by_trials(start)
        described, stretch = self._by_motion(start, self._imu)
        refinements = [
            Refinement(stretch, found, has_mount=self._has_mount, threads=self._threads)
            for found in described
        ]
        best = _best(refinements)
        best.require_scale_of_ranges()
        if (held := best.found()) is None:
            raise NotFoundError(best.trial.sentence)
        return held

    def _by_trials(self, start: Payload) -> Payload:
        given = self._given if self._has_mount else None
        return describe_by_trials(self._stretch, start, given, threads=self._threads)

    def _by_motion(self, start: Payload, imu_topic: str) -> tuple[list[Payload], Stretch]:
        turned, stretch = self._turned(start)
        found = describe_by_motion(
            stretch, turned, imu_topic, has_mount=self._has_mount, threads=self._threads
        )
        likeliest = found[0]
        if likeliest.encoder is not None and likeliest.lidar.mirrored and not start.lidar.mirrored:
            # A mirrored lidar has seemed to turn the other way.
            return self._by_motion(edits.with_lidar(start, mirrored=True), imu_topic)
        return [_with_zero(turned, one) for one in found], stretch

    def _turned(self, start: Payload) -> tuple[Payload, Stretch]:
        """Return payload and stretch with the joint that turns the lidar, if one does."""
        if self._encoder is None:
            return start, self._stretch
        alone = start.model_copy(update={"encoder": None})
        motion = followed(self._stretch.read_as(alone), alone, self._threads)
        joints = _joints(self._paths, start, self._stretch)
        found = describe_motor(motion, joints, start, self._encoder)
        assert found.encoder is not None
        angles = joints[found.encoder.joint, found.encoder.unit]
        signed = EncoderBatch(angles.times, found.encoder.sign * angles.angles)
        return found, self._stretch.with_encoder(signed)


def _best(refinements: Sequence[Refinement]) -> Refinement:
    """Return the first that holds without strain, else the least strained that holds, else the first."""
    for refinement in refinements:
        if refinement.trial.is_consistent and not refinement.trial.is_strained:
            return refinement
    holding = [r for r in refinements if r.trial.is_consistent]
    return min(holding, key=lambda r: r.trial.force, default=refinements[0])


def _require_motion(imu: ImuBatch) -> None:
    """Refuse a head that does not turn: at rest every set-up agrees with what is seen."""
    if len(imu.times) > 1 and float(np.ptp(imu.times)) > LEAST_TURNING:
        times = np.arange(imu.times[0] + STEP / 2, imu.times[-1] - STEP / 2, STEP)
        rates = np.linalg.norm(Averages(imu.times, imu.gyro).about(times, STEP / 2), axis=1)
        if STEP * float((rates > TURNING).sum()) >= LEAST_TURNING:
            return
    msg = (
        "the head does not turn, or for too short a time, and only motion shows how it is set up: "
        "record some seconds with turns about two axes"
    )
    raise NotFoundError(msg)


def _with_clocks(recording: Recording, payload: Payload) -> Payload:
    """Return the payload with the offsets of clocks that count from somewhere else."""
    offsets = recording.clock_offsets()
    if "imu" in offsets:
        before = 0.0 if payload.imu is None else payload.imu.clock_offset
        payload = edits.with_imu(payload, clock_offset=before + offsets["imu"])
    if "encoder" in offsets and payload.encoder is not None:
        before = payload.encoder.clock_offset
        payload = edits.with_encoder(payload, clock_offset=before + offsets["encoder"])
    return payload


def _joints(paths: Sequence[Path], payload: Payload, stretch: Stretch) -> dict[Joint, EncoderBatch]:
    """Read the angles of each joint in each unit, during a stretch."""
    with Recording(paths, payload, strict=False) as recording:
        names = recording.joints
    found: dict[Joint, EncoderBatch] = {}
    # The only joint of a topic need not be named.
    encoder = payload.encoder
    only = None if encoder is None else encoder.joint
    # A joint of /tf is in radians, always.
    units = UNITS if encoder is None or encoder.from_tf is None else UNITS[:1]
    for name in names if len(names) > 1 else (only,):
        for unit in units:
            read = edits.with_encoder(payload, joint=name, unit=unit, sign=1)
            with Recording(paths, read, strict=False) as recording:
                batches = [b for b in recording.encoder_batches() if isinstance(b, EncoderBatch)]
            if batches:
                found[name, unit] = _during(batches, stretch)
    return found


def _during(batches: list[EncoderBatch], stretch: Stretch) -> EncoderBatch:
    times = np.concatenate([b.times for b in batches])
    angles = np.concatenate([b.angles for b in batches])
    lidar = stretch.lidar.times
    keep = (times >= lidar[0] - 1.0) & (times <= lidar[-1] + 1.0)
    return EncoderBatch(times[keep], angles[keep])


def _with_zero(start: Payload, found: Payload) -> Payload:
    """Return the payload with a turn of the motor about its own axis as the encoder's zero."""
    if (
        found.encoder is None
        or start.encoder is None
        or start.encoder.T_imu_motor == found.encoder.T_imu_motor
    ):
        return found
    before, after = start.encoder.T_imu_motor.pose.R, found.encoder.T_imu_motor.pose.R
    turn = zero_between(before, after, np.array(found.encoder.axis))
    if turn is None:
        return found
    zero = float(np.remainder(start.encoder.zero + turn + np.pi, 2 * np.pi) - np.pi)
    return edits.with_encoder(found, zero=zero, T_imu_motor=start.encoder.T_imu_motor)
