# SPDX-License-Identifier: MIT OR Apache-2.0
"""Try descriptions of a head one after the other, first at a glance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.mount import FixedMount
from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.noise import with_at_least
from bentwing.calibrate.set_up.refine import Refinement
from bentwing.calibrate.set_up.scales import require_scale_of_gyro, require_scale_of_ranges
from bentwing.calibrate.set_up.trial import richest, try_payload

if TYPE_CHECKING:
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.calibrate.set_up.trial import Trial
    from bentwing.odometry.imu_noise import ImuNoise
    from bentwing.recording import Payload

TRIED, GLANCE = 6.0, 3.0  # s of the richest motion on which descriptions are tried, and first seen
AS_DESCRIBED = 0.02  # rad, std of a rotation that may hold
CLOSE = 0.2  # rad, std of a rotation that is about right
UNKNOWN_LATENCY = 0.02  # s, std once it was found
UNKNOWN_SHIFT = 0.1  # m, std where no mount is described


class Trials:
    """Tries descriptions on the richest part of a stretch.

    Parameters
    ----------
    has_mount : whether the shift of the lidar on the IMU is described
    """

    def __init__(
        self, stretch: Stretch, noise: ImuNoise, *, has_mount: bool, threads: int | None
    ) -> None:
        self._stretch, self._noise, self._threads = stretch, noise, threads
        self._has_mount = has_mount
        self._known: dict[tuple[str, float, float], Trial] = {}
        self._best: Trial | None = None
        self._refused: list[Refinement] = []
        self._strained: list[Refinement] = []

    def as_described(self, payload: Payload) -> Payload | None:
        """Return what a description has become if all fits together with it and it hardly changes."""
        return self._consistent(payload, AS_DESCRIBED)

    def about(self, payload: Payload) -> Payload | None:
        """Return what a description has become if all fits together with it, its rotation about right."""
        return self._consistent(payload, CLOSE)

    def at_a_glance(self, payload: Payload) -> Payload | None:
        """Return the same, for one that most likely does not fit."""
        glance = self._tried(payload, CLOSE, GLANCE)
        if not glance.is_promising:
            return None
        # What it saw first was blurred by where it came from, and may still have been the second time.
        again = self._tried(self._learned(payload, glance), CLOSE, TRIED)
        if again.is_promising and not again.is_consistent:
            again = self._tried(self._learned(payload, again), CLOSE, TRIED)
        return self._refined(payload, again)

    def require_scale_of_gyro(self, payload: Payload) -> None:
        """Refuse a gyro with a wrong scale, where only that contradicts a description.

        Raises
        ------
        DefectError
        """
        require_scale_of_gyro(
            lambda scale: self._with_gyro(scale)._tried(payload, CLOSE, GLANCE),
            lambda scale: self._with_gyro(scale)._tried(payload, CLOSE, TRIED),
        )

    def require_scale_of_ranges(self, payload: Payload) -> None:
        """Refuse ranges with a wrong scale.

        Raises
        ------
        DefectError
        """
        scale_of = payload.lidar.range_scale
        require_scale_of_ranges(
            lambda scale: self._tried(
                edits.with_lidar(payload, range_scale=scale_of / scale), AS_DESCRIBED, TRIED
            )
        )

    def require_scale_in_what_was_refused(self) -> None:
        """Refuse ranges with a wrong scale, where only that contradicts the best of what was tried for long.

        Raises
        ------
        DefectError
        """
        if self._refused:
            max(self._refused, key=lambda r: r.trial.score).require_scale_of_ranges()

    def _with_gyro(self, scale: float) -> Trials:
        stretch = self._stretch.with_gyro_scaled(1.0 / scale)
        return Trials(stretch, self._noise, has_mount=self._has_mount, threads=self._threads)

    @property
    def failure(self) -> str:
        """Say how well the best description did."""
        return "nothing that can be seen" if self._best is None else self._best.sentence

    def least_strained(self) -> Payload | None:
        """Return the best of what was set aside because its accelerometer disagrees."""
        strained = sorted(self._strained, key=lambda r: r.trial.force)
        return self._found_by(strained[0]) if strained else None

    def _consistent(self, payload: Payload, rotation: float) -> Payload | None:
        trial = self._tried(payload, rotation, TRIED)
        return self._refined(payload, trial, believed=rotation == AS_DESCRIBED)

    def _refined(self, payload: Payload, trial: Trial, *, believed: bool = False) -> Payload | None:
        """Return what a likely trial has told, if it holds for longer as well.

        Parameters
        ----------
        believed : also where the accelerometer disagrees more than it does with a right description
        """
        if not trial.is_likely:
            return None
        refinement = Refinement(
            self._stretch,
            self._learned(payload, trial),
            has_mount=self._has_mount,
            threads=self._threads,
        )
        self._note(refinement.trial)
        if not refinement.trial.is_consistent:
            self._refused.append(refinement)
            return None
        if refinement.trial.is_strained and not believed:
            self._strained.append(refinement)
            return None
        return self._found_by(refinement)

    def _found_by(self, refinement: Refinement) -> Payload | None:
        found = refinement.found()
        if found is not None:
            refinement.require_scale_of_ranges()
        return found

    def _learned(self, payload: Payload, trial: Trial) -> Payload:
        """Return a payload with the delay and what a trial has told of the mount."""
        assert trial.calibration is not None
        mount = trial.calibration.mount
        base = mount.T_imu_lidar if isinstance(mount, FixedMount) else mount.T_imu_motor
        placed = edits.with_rotation(payload, base.R)
        if not self._has_mount:
            placed = edits.with_shift(placed, base.translation)
        return edits.with_latency(placed, trial.calibration.source_latency)

    def _tried(self, payload: Payload, rotation: float, length: float) -> Trial:
        key = (payload.model_dump_json(), rotation, length)
        if key not in self._known:
            self._known[key] = self._with(payload, rotation, length)
            self._note(self._known[key])
        return self._known[key]

    def _with(self, payload: Payload, rotation: float, length: float) -> Trial:
        wide = edits.with_std(
            with_at_least(payload, self._noise),
            extrinsic_rotation=rotation,
            extrinsic_translation=UNKNOWN_SHIFT if rotation > AS_DESCRIBED else 0.0,
            latency=UNKNOWN_LATENCY,
        )
        read = self._stretch.read_as(wide)
        start, _ = richest(read.imu, TRIED)
        return try_payload(read.part(start, start + length), wide, self._threads)

    def _note(self, trial: Trial) -> None:
        if self._best is None or trial.score > self._best.score:
            self._best = trial
