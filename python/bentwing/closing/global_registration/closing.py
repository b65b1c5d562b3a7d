# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate and its recording to the estimate that agrees with itself everywhere."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import _core
from bentwing.base.errors import EstimationError
from bentwing.base.log import get_logger
from bentwing.base.mount import MotorMount
from bentwing.closing.global_registration.biases import drift_of, has_inertial_states
from bentwing.closing.global_registration.budget import HELD, Budget
from bentwing.closing.global_registration.fixed import fixed_piece
from bentwing.closing.global_registration.matching import MatchingPlan
from bentwing.closing.global_registration.outcome import closed_estimate, improved, record_of
from bentwing.closing.global_registration.settings import GlobalSettings
from bentwing.closing.global_registration.shown_noise import shown_noise, with_believed_noise
from bentwing.closing.global_registration.stretches import (
    Stretches,
    collect,
    interval_of,
    length_of,
)
from bentwing.odometry.continuous.core_settings import CoreSettings
from bentwing.odometry.continuous.slow_states import (
    RANGE_STATES,
    SLICES,
    UNIT_STATES,
    SlowStatePrior,
    places_of,
)
from bentwing.odometry.core_states import core_globals, core_samples

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

    from bentwing.base.estimate import Estimate
    from bentwing.recording import Batch, ImuBatch, Payload

_log = get_logger(__name__)

_OPTIONAL = places_of(RANGE_STATES)


@dataclass(frozen=True, slots=True)
class Closed:
    """What became of an estimate.

    Attributes
    ----------
    estimate : corrected, or as it was where that failed
    record : what was done, for run.json
    warnings : sentences, where it failed
    """

    estimate: Estimate
    record: dict[str, Any]
    warnings: list[str] = field(default_factory=list)


@dataclass(frozen=True, slots=True)
class Recorded:
    """An estimate with what was measured along it.

    Attributes
    ----------
    segments : the trajectory of each, where it is now, with the surfels that were seen along it
    """

    estimate: Estimate
    payload: Payload
    segments: list[Stretches]
    inertial: ImuBatch


@dataclass(frozen=True, slots=True)
class Registered:
    """What became of several estimates.

    Attributes
    ----------
    estimates : corrected, or as they were where that failed
    record : what was done, for run.json
    failure : why nothing was corrected; None if it was
    """

    estimates: list[Estimate]
    record: dict[str, Any]
    failure: str | None = None


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
    The corrected estimate, or the one given and a warning where the correction cannot be trusted.
    """
    settings = settings or GlobalSettings()
    budget = budget or Budget.of(length_of(estimate), settings)
    started = time.perf_counter()
    segments, inertial = collect(
        batches,
        estimate,
        length=settings.stretch,
        settings=settings.surfels.model_copy(update={"max_rate": budget.rate}),
        range_sigma=payload.lidar.range_sigma,
        threads=threads or 0,
    )
    collected = time.perf_counter() - started
    recorded = Recorded(estimate, payload, segments, inertial)
    found = register_jointly(
        [recorded], settings=settings, budget=budget, known=known, threads=threads
    )
    if "timings" in found.record:
        found.record["timings"] = {"surfels": collected, **found.record["timings"]}
    warnings = []
    if found.failure is not None:
        what = "the loops were not closed, the trajectory is open-loop"
        if known is not None:
            what = (
                "the trajectory was not registered with the map, its places alone say where it is"
            )
        warnings = [f"{what}: {found.failure}"]
        _log.warning(warnings[0])
    return Closed(found.estimates[0], found.record, warnings)


def register_jointly(
    recorded: Sequence[Recorded],
    *,
    settings: GlobalSettings | None = None,
    budget: Budget | None = None,
    known: _core.Surfels | None = None,
    threads: int | None = None,
) -> Registered:
    """Correct estimates by everything that any of them saw more than once (Kaul 2015, section 2.2).

    Parameters
    ----------
    recorded : roughly aligned with each other; the first one defines the map
    budget : what may be held; default: that of the settings for all of them together
    known : as of `close_loops`; where there are any they define the map
    threads : default: all cores
    """
    settings = settings or GlobalSettings()
    seconds = sum(length_of(r.estimate) for r in recorded)
    budget = budget or Budget.of(seconds, settings)
    estimates = [r.estimate for r in recorded]
    record: dict[str, Any] = {"applied": False, "budget": budget}
    if not any(s.surfels for r in recorded for s in r.segments):
        return _failed(estimates, record, "there are no points along the trajectory")
    started = time.perf_counter()
    fixed = [] if known is None else [fixed_piece(known)]
    try:
        found = _core.register_globally(
            [*fixed, *(_piece(s, r, settings.frozen) for r in recorded for s in r.segments)],
            settings=CoreSettings.of(
                settings.registration(budget.seconds),
                _cautious([with_believed_noise(r.payload, r.estimate) for r in recorded]),
                max(interval_of(e) for e in estimates),
            ),
            plan=MatchingPlan(
                settings.n_visits,
                settings.min_overlap,
                HELD,
                settings.posterior_interval_for(budget.seconds),
            ),
            threads=threads or 0,
        )
    except EstimationError as error:
        return _failed(estimates, record, str(error))
    timings = {"register": time.perf_counter() - started}
    trajectories = [s.trajectory for r in recorded for s in r.segments]
    record.update(record_of(found, trajectories, found.samples[len(fixed) :], timings))
    why = improved(found)
    if why:
        return _failed(estimates, record, why)
    record["applied"] = True
    closed, first = [], len(fixed)
    for r in recorded:
        own = slice(first, first + len(r.segments))
        corrected = closed_estimate(
            r.estimate,
            found,
            [s.trajectory for s in r.segments],
            own,
            payload=r.payload,
            has_imu=len(r.inertial.times) > 0,
            in_map=known is not None,
        )
        closed.append(corrected)
        first = own.stop
    return Registered(closed, record)


def _failed(estimates: list[Estimate], record: dict[str, Any], why: str) -> Registered:
    record["reason"] = why
    return Registered(estimates, record, why)


def _cautious(payloads: Sequence[Payload]) -> Payload:
    """Return the first payload with the largest noise of all, as rows of all have one weight."""
    first = payloads[0]
    sigma = max(p.lidar.range_sigma for p in payloads)
    update: dict[str, Any] = {"lidar": first.lidar.model_copy(update={"range_sigma": sigma})}
    imus = [p.imu for p in payloads if p.imu is not None]
    if imus:
        noises = {
            name: max(getattr(imu, name) for imu in imus) for name in ("gyro_noise", "accel_noise")
        }
        update["imu"] = imus[0].model_copy(update=noises)
    return first.model_copy(update=update)


def _piece(stretches: Stretches, recorded: Recorded, frozen: Iterable[str]) -> _core.Piece:
    estimate, inertial, payload = recorded.estimate, recorded.inertial, recorded.payload
    used = has_inertial_states(estimate) and payload.imu is not None and len(inertial.times) > 0
    # The map is level, and stays so: gravity is where it belongs, the trajectory may tilt.
    known = SLICES.keys() - estimate.calibration.std.keys() - set(RANGE_STATES)
    prior = SlowStatePrior(
        payload.imu if used else None,
        has_motor=isinstance(estimate.calibration.mount, MotorMount),
        moving=True,
        frozen={*known, *frozen, "gravity"},
        # Of a mount that no payload describes the open loop may have left much to be found.
        stated={name: tuple(std) for name, std in estimate.calibration.std.items()},
    )
    unit = payload.imu.errors_expected if used and payload.imu is not None else {}
    doubted = {name: unit[name] for name in UNIT_STATES if name in estimate.calibration.std}
    return _core.Piece(
        core_samples(stretches.trajectory),
        stretches.surfels,
        _steadied(stretches, inertial, estimate) if used else None,
        core_globals(estimate.calibration),
        information=_doubting(prior.information, doubted),
        offset=prior.offset,
        frozen=prior.frozen.tolist(),
        optional=_OPTIONAL.tolist(),
        doubted=places_of(doubted).tolist(),
        shown_noise=shown_noise(estimate) if used else ([], []),
    )


def _doubting(information: Array, std: Mapping[str, float]) -> Array:
    """Return information (57, 57) with that of states which are held though they are uncertain."""
    found = information.copy()
    for name, size in std.items():
        places = np.arange(len(found))[SLICES[name]]
        found[places, places] = size**-2
    return found


def _steadied(stretches: Stretches, inertial: ImuBatch, estimate: Estimate) -> _core.Imu:
    """Inertial samples around a segment with the biases of the calibration all the time."""
    times = stretches.trajectory.times
    kept = (inertial.times > times[0] - 0.2) & (inertial.times < times[-1] + 0.2)
    at = inertial.times[kept]
    return _core.Imu(
        at,
        inertial.gyro[kept] - drift_of(estimate, "gyro_bias", at),
        inertial.accel[kept] - drift_of(estimate, "accel_bias", at),
        None if inertial.at_limit is None else inertial.at_limit[kept],
    )
