# SPDX-License-Identifier: MIT OR Apache-2.0
"""The first poses and slow states of a pass: at rest, in motion, or after a break."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.odometry.continuous.slow_states import SlowStatePrior, initial_std
from bentwing.odometry.core_states import core_globals
from bentwing.odometry.segments import extrapolated, heading
from bentwing.odometry.start import attitude_of
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from bentwing.odometry.continuous.core_settings import CoreSettings
    from bentwing.odometry.continuous.settings import ContinuousSettings
    from bentwing.odometry.start import Start
    from bentwing.recording import Payload


@dataclass(frozen=True, slots=True)
class Situation:
    """What the passes over a recording have in common."""

    payload: Payload
    settings: ContinuousSettings
    core: CoreSettings
    threads: int
    has_imu: bool


def begin_pass(
    situation: Situation, start: Start, first: float, before: OdometryPass | None
) -> OdometryPass:
    """Return a pass with its first samples and what is known of the slow states.

    Parameters
    ----------
    first : time of the first sample, s
    before : the pass up to the last break
    """
    slow = _described(situation, start) if before is None else before.globals.levelled()
    prior = _prior(situation, start, before)
    quat = start.quat_xyzw
    if start.static is not None:
        quat = attitude_of(start.static.accel_mean - slow.accel_bias)
        prior.observe_rest(quat, start.static.accel_std)
    n = max(2, int((start.hold - first) / DT) + 1)
    turns = geometry.exp(DT * np.arange(n)[:, None] * start.rate)
    positions = np.zeros((n, 3))
    quats = geometry.multiply(np.broadcast_to(quat, turns.shape), turns)
    if before is not None:
        at, quat = extrapolated(before.trajectory(), first)
        turn = heading(geometry.multiply(quat, geometry.inverse(quats[0])))
        positions = at + geometry.rotate(turn, positions)
        quats = geometry.multiply(np.broadcast_to(turn, quats.shape), quats)
    return OdometryPass(
        _core.Samples(first, DT, positions, quats),
        slow,
        prior,
        situation.settings,
        situation.core,
        threads=situation.threads,
        resting=start.static is not None,
    )


def _described(situation: Situation, start: Start) -> _core.Globals:
    described = described_calibration(situation.payload)
    return core_globals(replace(described, gyro_bias=start.gyro_bias, accel_bias=start.accel_bias))


def _prior(situation: Situation, start: Start, before: OdometryPass | None) -> SlowStatePrior:
    moving = start.static is None
    if before is not None:
        inherited = deepcopy(before.prior)
        inherited.reset("gravity", initial_std(moving=moving)["gravity"])
        return inherited
    prior = SlowStatePrior(
        situation.payload.imu if situation.has_imu else None,
        has_motor=situation.payload.encoder is not None,
        moving=moving,
        frozen=situation.settings.frozen,
    )
    if start.static is not None:
        prior.reset("gyro_bias", start.static.gyro_bias_std)
    return prior
