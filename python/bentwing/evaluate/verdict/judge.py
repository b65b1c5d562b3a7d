# SPDX-License-Identifier: MIT OR Apache-2.0
"""All evidence on a result: while it is estimated, when loops are closed, and on the map."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.head import judge_calibration, judge_clocks, judge_slice
from bentwing.evaluate.verdict.inertial import judge_inertial
from bentwing.evaluate.verdict.matches import judge_matches
from bentwing.evaluate.verdict.path import judge_path
from bentwing.evaluate.verdict.rows import judge_rows
from bentwing.evaluate.verdict.usual import usual_of
from bentwing.evaluate.verdict.verdict import verdict_of
from bentwing.recording import imu_units

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.verdict.imu_samples import ImuSamples
    from bentwing.evaluate.verdict.inertial_track import InertialTrack
    from bentwing.evaluate.verdict.usual import Usual
    from bentwing.evaluate.verdict.verdict import Verdict
    from bentwing.evaluate.verdict.watch import Watch
    from bentwing.recording.payload import Payload

# So much of a trajectory says something of its set-up, s, m and rad, and of the units alone, s.
_SOON, _MOVED, _TURNED = 6.5, 0.3, 0.3
_SOON_UNITS = 4.0
# Of an error that a sample at its limit makes so much is left where it is bridged.
_BRIDGED_COUNTS = 0.25


def judge_estimate(estimate: Estimate, payload: Payload, watch: Watch) -> list[Evidence]:
    """Return the evidence on an open-loop estimate and on the samples that it was made of."""
    calibration = estimate.calibration
    return [
        *_judge_samples(watch, usual_of(estimate.windows)),
        *judge_matches(estimate.windows),
        *judge_inertial(estimate, watch.track, payload.imu),
        *judge_rows(estimate.windows, payload.imu),
        *judge_calibration(calibration, payload),
        *judge_clocks(estimate.windows),
        *judge_slice(estimate.trajectory, calibration, watch.returns.normal),
        *judge_path(estimate),
    ]


def judge_so_far(estimate: Estimate | None, payload: Payload, watch: Watch) -> Verdict:
    """Judge an estimate that is under way, every few seconds or so; takes some milliseconds.

    Says `failed` or `doubtful` as soon as that is certain, after seven to ten seconds of motion; until
    then, and on good recordings, `good`. Units are judged sooner.

    Parameters
    ----------
    estimate : what is known so far, `engine.current.estimate()`; None if that is nothing yet
    payload : with which it began
    watch : has taken every batch that the engine was fed
    """
    if estimate is not None and _has_moved(estimate.trajectory):
        return verdict_of(judge_estimate(estimate, payload, watch))
    return verdict_of(_judge_units(watch.track) if watch.imu.length > _SOON_UNITS else [])


def _has_moved(trajectory: Trajectory) -> bool:
    """Tell whether a trajectory is long enough, in time and in space, to say something of its set-up."""
    times, positions, quats = trajectory.times, trajectory.positions, trajectory.quats_xyzw
    if len(times) < 2 or times[-1] - times[0] < _SOON:
        return False
    moved = float(np.ptp(positions, axis=0).max())
    turned = float(np.max(1.0 - np.abs(quats @ quats[0])))
    return moved > _MOVED or turned > 1.0 - np.cos(_TURNED / 2)


def _judge_samples(watch: Watch, usual: Usual) -> list[Evidence]:
    found = []
    if watch.imu.n:
        found = [*_judge_imu(watch.imu, usual), *_judge_units(watch.track)]
    returns = watch.returns
    return [
        *found,
        Evidence("even_ranges", 1.0 / max(returns.spread, 1e-3)),
        Evidence("point_order" if returns.is_out_of_order else "scatter", returns.scatter),
    ]


def _judge_imu(imu: ImuSamples, usual: Usual) -> list[Evidence]:
    constant = [Evidence("constant", 1.0, (), {"instrument": name}) for name in imu.constant]
    return [
        *constant,
        Evidence("repeated", imu.repeated_share),
        *_judge_limits(imu, usual),
        Evidence("imu_period", imu.period, (), {"rate": 1.0 / imu.period}),
    ]


def _judge_limits(imu: ImuSamples, usual: Usual) -> list[Evidence]:
    """Judge by the samples at the end of a range; where an estimator bridges them they do less harm."""
    names = ("gyro_limit", "accelerometer_limit")
    counts = _BRIDGED_COUNTS if usual.bridges else 1.0
    return [
        Evidence(
            name,
            max(0.0, share - bridged) + counts * bridged,
            (),
            {"share": 100.0 * max(share, bridged)},
        )
        for name, share, bridged in zip(names, imu.limits, imu.bridged, strict=True)
    ]


def _judge_units(track: InertialTrack) -> list[Evidence]:
    """Judge by the first minute whether the samples are in m/s² and rad/s."""
    times, gyro, accel = track.samples(imu_units.CHECKED)
    problems = imu_units.problems(times, gyro, accel)
    return [Evidence("units", 1.0, (), {"problem": problem}) for problem in problems[:1]]
