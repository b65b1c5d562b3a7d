# SPDX-License-Identifier: MIT OR Apache-2.0
"""Refine a set-up that was found by what is seen with it, and test that it holds."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from bentwing.base.mount import FixedMount
from bentwing.calibrate.set_up import edits
from bentwing.calibrate.set_up.errors import NotFoundError
from bentwing.calibrate.set_up.noise import ImuNoise
from bentwing.calibrate.set_up.scales import require_scale_of_ranges
from bentwing.calibrate.set_up.trial import try_payload
from bentwing.calibrate.set_up.trials import richest
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.mount import Pose
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.calibrate.set_up.trial import Trial
    from bentwing.recording import Payload

# Standard deviations of what was found before: s, rad; and of a shift that nothing has told yet, m.
FOUND_LATENCY, FOUND_ROTATION, UNKNOWN_SHIFT = 0.005, 0.03, 0.15
REFINED = 12.0  # s
CAUTION = 2.0  # what a short stretch says of a mount is less certain than it seems


def refined(stretch: Stretch, payload: Payload, *, has_mount: bool, threads: int | None) -> Payload:
    """Return the payload with latency and mount as the estimator finds them, starting from it.

    Raises
    ------
    NotFoundError
        What is seen does not fit together with it.
    """
    wide = edits.with_std(payload, latency=FOUND_LATENCY, extrinsic_rotation=FOUND_ROTATION)
    if not has_mount:
        wide = edits.with_std(wide, extrinsic_translation=UNKNOWN_SHIFT)
    read = stretch.read_as(wide)
    wide = ImuNoise.of(read.imu).at_least_in(wide)
    span = richest(read.imu, REFINED)

    @cache
    def tried(scale: float) -> Trial:
        scaled = edits.with_lidar(wide, range_scale=wide.lidar.range_scale / scale)
        return try_payload(stretch.read_as(scaled).part(*span), scaled, threads)

    trial = tried(1.0)
    require_scale_of_ranges(tried)
    if not trial.is_consistent or trial.calibration is None:
        raise NotFoundError(trial.sentence)
    mount = trial.calibration.mount
    found = edits.with_latency(payload, trial.calibration.source_latency)
    if not has_mount:
        # What little was seen leaves of it is still to be found.
        found = edits.with_std(found, **_std(trial.calibration))
    if isinstance(mount, FixedMount):
        return found.model_copy(update={"T_imu_lidar": _transform(mount.T_imu_lidar)})
    return edits.with_encoder(
        found, T_imu_motor=_transform(mount.T_imu_motor), zero=mount.encoder_zero
    )


def _std(found: Calibration) -> dict[str, float]:
    names = ("extrinsic_rotation", "extrinsic_translation")
    return {name: CAUTION * max(found.std[name]) for name in names}


def _transform(pose: Pose) -> Transform:
    return Transform(
        translation=tuple(float(x) for x in pose.translation),
        quaternion=tuple(float(x) for x in pose.quaternion),
    )
