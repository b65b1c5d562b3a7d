# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate and its recording to the estimate that agrees with itself everywhere."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bentwing import _core
from bentwing.errors import EstimationError
from bentwing.estimators.core_settings import CoreSettings
from bentwing.estimators.core_states import core_globals, core_samples
from bentwing.estimators.mount import MotorMount
from bentwing.estimators.slow_states import SLICES, SlowStatePrior
from bentwing.global_registration.biases import drift_of, has_inertial_states
from bentwing.global_registration.budget import HELD, Budget
from bentwing.global_registration.fixed import fixed_piece
from bentwing.global_registration.matching import MatchingPlan
from bentwing.global_registration.outcome import closed_estimate, improved, record_of
from bentwing.global_registration.settings import GlobalSettings
from bentwing.global_registration.stretches import (
    Inertial,
    Stretches,
    collect,
    interval_of,
    length_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bentwing.estimators.interface import Estimate
    from bentwing.recording import Batch, Payload


@dataclass(frozen=True, slots=True)
class Closed:
    """What became of an estimate.

    Attributes
    ----------
    estimate : corrected, or as it was where that failed
    record : what was done, for run.json
    """

    estimate: Estimate
    record: dict[str, Any]


def close_loops(
    estimate: Estimate,
    batches: Iterable[Batch],
    payload: Payload,
    *,
    settings: GlobalSettings | None = None,
    budget: Budget | None = None,
    known: _core.Surfels | None = None,
    threads: int | None = None,
) -> Closed:
    """Correct an estimate by everything its recording saw more than once (Kaul 2015, section 2.2).

    Parameters
    ----------
    estimate : of any estimator
    batches : of the recording, as the estimator got them
    budget : what may be held; default: that of the settings for the length of the estimate
    known : surfels of a map that is already right: the estimate, which must lie within reach of the
        matches, comes to it, and it does not move
    threads : default: all cores

    Returns
    -------
    The corrected estimate, or the one given, with a warning, where the correction cannot be trusted.
    """
    settings = settings or GlobalSettings()
    budget = budget or Budget.of(length_of(estimate), settings)
    started = time.perf_counter()
    surfels = settings.surfels.model_copy(update={"max_rate": budget.rate})
    pieces, inertial = collect(
        batches,
        estimate,
        length=settings.stretch,
        settings=surfels,
        range_sigma=payload.lidar.range_sigma,
        threads=threads or 0,
    )
    collected = time.perf_counter()
    record: dict[str, Any] = {"applied": False, "budget": budget}
    if not any(p.surfels for p in pieces):
        return _unchanged(estimate, record, "there are no points along the trajectory")
    fixed = [] if known is None else [fixed_piece(known)]
    try:
        found = _core.register_globally(
            [*fixed, *(_piece(p, inertial, estimate, payload) for p in pieces)],
            settings=CoreSettings.of(
                settings.registration(budget.seconds), payload, interval_of(estimate)
            ),
            plan=MatchingPlan(settings.n_visits, settings.min_overlap, HELD),
            threads=threads or 0,
        )
    except EstimationError as error:
        return _unchanged(estimate, record, str(error))
    timings = {
        "surfels": collected - started,
        "register": time.perf_counter() - collected,
    }
    segments = [p.trajectory for p in pieces]
    moved = found.samples[len(fixed) :]
    record.update(record_of(found, segments, moved, timings))
    why = improved(found)
    if why:
        return _unchanged(estimate, record, why)
    record["applied"] = True
    return Closed(closed_estimate(estimate, found, segments, moved), record)


def _unchanged(estimate: Estimate, record: dict[str, Any], why: str) -> Closed:
    record["reason"] = why
    sentence = f"the loops were not closed, the trajectory is open-loop: {why}"
    return Closed(replace(estimate, warnings=[*estimate.warnings, sentence]), record)


def _piece(
    stretches: Stretches, inertial: Inertial, estimate: Estimate, payload: Payload
) -> _core.Piece:
    used = has_inertial_states(estimate) and payload.imu is not None and len(inertial.times) > 0
    # The map is level, and stays so: gravity is where it belongs, the trajectory may tilt.
    known = [name for name in SLICES if name not in estimate.calibration.std]
    prior = SlowStatePrior(
        payload.imu if used else None,
        has_motor=isinstance(estimate.calibration.mount, MotorMount),
        moving=True,
        frozen={*known, "gravity"},
    )
    return _core.Piece(
        core_samples(stretches.trajectory),
        stretches.surfels,
        _steadied(stretches, inertial, estimate) if used else None,
        core_globals(estimate.calibration),
        information=prior.information,
        offset=prior.offset,
        frozen=prior.frozen.tolist(),
    )


def _steadied(stretches: Stretches, inertial: Inertial, estimate: Estimate) -> _core.Imu:
    """Inertial samples around a segment with the biases of the calibration all the time."""
    times = stretches.trajectory.times
    kept = (inertial.times > times[0] - 0.2) & (inertial.times < times[-1] + 0.2)
    at = inertial.times[kept]
    return _core.Imu(
        at,
        inertial.gyro[kept] - drift_of(estimate, "gyro_bias", at),
        inertial.accel[kept] - drift_of(estimate, "accel_bias", at),
    )
