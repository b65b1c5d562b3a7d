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
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.odometry.continuous.slow_states import (
    RANGE_STATES,
    SlowStatePrior,
    initial_std,
)
from bentwing.odometry.core_states import core_globals
from bentwing.odometry.segments import extrapolated, heading
from bentwing.odometry.start import attitude_of, find_start, level_start
from bentwing.recording.described import described_calibration

if TYPE_CHECKING:
    from bentwing.odometry.buffer import BatchBuffer
    from bentwing.odometry.continuous.settings import ContinuousSettings
    from bentwing.odometry.start import Start
    from bentwing.recording import Payload

# A rest shorter than this is waited out before the start is judged, s.
LOOK_AHEAD = 6.0


@dataclass(frozen=True, slots=True)
class Beginning:
    """Where a pass begins.

    Attributes
    ----------
    time : of the first sample, s
    settings : with the window that suits the sensors
    has_imu : whether there are inertial samples
    """

    start: Start
    time: float
    settings: ContinuousSettings
    has_imu: bool


def find_beginning(
    buffer: BatchBuffer,
    payload: Payload,
    settings: ContinuousSettings,
    *,
    ready: float,
    finishing: bool,
) -> Beginning | None:
    """Return where a pass over the data begins; None while that cannot be said yet.

    Parameters
    ----------
    ready : s, until which the data is complete
    finishing : whether there will be no more of it
    """
    lidar, imu = buffer.lidar_span, buffer.imu_span
    if lidar is None or (ready - lidar[0] < LOOK_AHEAD and not finishing):
        return None
    if imu is None or payload.imu is None:
        return Beginning(level_start(lidar[0]), lidar[0], settings.without_imu(), imu is not None)
    # The trajectory begins with the later of both sensors.
    first = max(lidar[0], imu[0] + 2 * DT)
    start = find_start(buffer.imu(imu[0], imu[1] + 1.0), payload.imu, first)
    still_resting = start.static is not None and start.hold >= imu[1] - 1.0
    if still_resting and not finishing:
        return None
    return Beginning(start, first, settings, has_imu=True)


def begin_pass(
    beginning: Beginning, payload: Payload, before: OdometryPass | None, threads: int
) -> OdometryPass:
    """Return a pass with its first samples and what is known of the slow states.

    Parameters
    ----------
    before : the pass up to the last break
    """
    start, first = beginning.start, beginning.time
    slow = _described(payload, start, first) if before is None else before.globals.levelled()
    prior = _prior(beginning, payload, before)
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
        beginning.settings,
        CoreSettings.of(beginning.settings.registration, payload, DT),
        threads=threads,
        resting=start.static is not None,
    )


def _described(payload: Payload, start: Start, first: float) -> _core.Globals:
    described = described_calibration(payload).with_epoch(first)
    known = replace(
        described, gyro_bias=start.gyro_bias, accel_bias=start.accel_bias, unit=start.unit
    )
    return core_globals(known)


def _prior(beginning: Beginning, payload: Payload, before: OdometryPass | None) -> SlowStatePrior:
    static = beginning.start.static
    moving = static is None
    if before is not None:
        inherited = deepcopy(before.prior)
        inherited.reset("gravity", initial_std(moving=moving)["gravity"])
        return inherited
    prior = SlowStatePrior(
        payload.imu if beginning.has_imu else None,
        has_motor=payload.encoder is not None,
        moving=moving,
        # Few seconds say too little of them; see the global registration.
        frozen=(*beginning.settings.frozen, *RANGE_STATES),
        stated={} if payload.calibration is None else payload.calibration.std,
    )
    if static is not None:
        prior.reset("gyro_bias", static.gyro_bias_std)
    return prior
