# SPDX-License-Identifier: MIT OR Apache-2.0
"""Refine a set-up that was found by what is seen with it, and test that it holds."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from bentwing.base.mount import MotorMount
from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.noise import with_at_least
from bentwing.calibrate.set_up.scales import require_scale_of_ranges
from bentwing.calibrate.set_up.trial import richest, try_payload
from bentwing.odometry.imu_noise import ImuNoise

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.calibrate.set_up.trial import Trial
    from bentwing.recording import Payload

# Standard deviations of what was found before: s, rad; and of a shift that nothing has told yet, m.
FOUND_LATENCY, FOUND_ROTATION, UNKNOWN_SHIFT = 0.005, 0.03, 0.15
REFINED = 12.0  # s
CAUTION = 2.0  # what a short stretch says of a mount is less certain than it seems


class Refinement:
    """A set-up that was found, over a longer time, with the estimator free to correct it.

    Parameters
    ----------
    payload : with the set-up that was found
    has_mount : whether the shift of the lidar on the IMU is described
    """

    def __init__(
        self, stretch: Stretch, payload: Payload, *, has_mount: bool, threads: int | None
    ) -> None:
        wide = edits.with_std(payload, latency=FOUND_LATENCY, extrinsic_rotation=FOUND_ROTATION)
        if not has_mount:
            wide = edits.with_std(wide, extrinsic_translation=UNKNOWN_SHIFT)
        if not has_mount and payload.encoder is not None:
            wide = edits.with_std(wide, motor_tilt=FOUND_ROTATION, motor_offset=UNKNOWN_SHIFT)
        read = stretch.read_as(wide)
        self._payload, self._has_mount = payload, has_mount
        self._stretch, self._threads = stretch, threads
        self._wide = with_at_least(wide, ImuNoise.of(read.imu))
        self._span = richest(read.imu, REFINED)
        self._tried = cache(self._tried_with)

    @property
    def trial(self) -> Trial:
        """What the estimator makes of it."""
        return self._tried(1.0)

    def require_scale_of_ranges(self) -> None:
        """Refuse ranges with a wrong scale.

        Raises
        ------
        DefectError
        """
        require_scale_of_ranges(self._tried)

    def found(self) -> Payload | None:
        """Return the payload with latency and mount as the estimator finds them; None if it does not hold."""
        trial = self.trial
        if not trial.is_consistent or trial.calibration is None:
            return None
        found = edits.with_latency(self._payload, trial.calibration.source_latency)
        if not self._has_mount:
            # What little was seen leaves of it is still to be found.
            found = edits.with_std(found, **_std(trial.calibration))
        return edits.with_mount(found, trial.calibration.mount)

    def _tried_with(self, scale: float) -> Trial:
        lidar = self._wide.lidar
        scaled = edits.with_lidar(self._wide, range_scale=lidar.range_scale / scale)
        part = self._stretch.read_as(scaled).part(*self._span)
        return try_payload(part, scaled, self._threads)


def _std(found: Calibration) -> dict[str, float]:
    names = ["extrinsic_rotation", "extrinsic_translation"]
    if isinstance(found.mount, MotorMount):
        names += ["motor_tilt", "motor_offset"]
    return {name: CAUTION * max(found.std[name]) for name in names}
