# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the passes over a recording say, as an `Estimate`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.covariances import PoseCovariances
from bentwing.base.estimate import Estimate
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.odometry_pass import MARGIN
from bentwing.odometry.continuous.slow_states import at_epoch, named_std
from bentwing.odometry.core_states import refined
from bentwing.odometry.health import unseen_sentences
from bentwing.odometry.segments import joined
from bentwing.odometry.unseen import Unseen, frame_std, with_frame, with_lever
from bentwing.odometry.unseen_lever import lever_covariance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.breaks import Break
    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.odometry.continuous.odometry_pass import OdometryPass
    from bentwing.recording import Payload


def estimate_of(
    passes: Sequence[OdometryPass],
    described: Calibration,
    breaks: Sequence[Break],
    *,
    first_turn: float,
    payload: Payload,
    has_imu: bool,
) -> Estimate:
    """Return what passes that follow each other say, levelled.

    Parameters
    ----------
    passes : at least one; between two of them the recording breaks
    described : the slow states as the payload has them
    breaks : that were judged
    first_turn : s, before which the head of a 2D lidar had not turned once, and saw single planes
    payload : as described
    has_imu : whether there are inertial samples
    """
    segments, last = [p.trajectory() for p in passes], passes[-1]
    gap = last.settings.registration.min_match_gap
    windows = [w for p in passes for w in p.windows]
    n_blind = sum(p.n_blind for p in passes)
    slow = last.globals
    whole = joined(segments)
    middle = 0.5 * float(whole.times[0] + whole.times[-1])
    found = refined(described, slow)
    std = named_std(at_epoch(last.covariance, middle - slow.latency_epoch), last.prior.frozen)
    imu = payload.imu if has_imu else None
    frame, lever = frame_std(found, std, imu), lever_covariance(whole, imu)
    calibration = replace(
        found,
        gravity=np.array([0.0, 0.0, STANDARD_GRAVITY]),
        std=with_lever(with_frame(std, frame), lever),
    ).with_epoch(middle)
    unseen = Unseen.of(frame, found, windows, payload, lever=lever)
    covariances = [
        unseen.covariances(p.covariances(s), s) for p, s in zip(passes, segments, strict=True)
    ]
    return Estimate(
        whole,
        calibration,
        windows=windows,
        counts={
            "estimate.windows": len(windows),
            "estimate.samples_without_imu": n_blind,
        },
        timings={name: sum(p.timings[name] for p in passes) for name in last.timings},
        health=_health(windows, n_blind, since=_since(windows, first_turn, gap), has_imu=has_imu),
        notes=_notes(windows, first_turn),
        breaks=[*breaks],
        segments=[(float(s.times[0]), float(s.times[-1])) for s in segments],
        covariances=PoseCovariances.joined(covariances),
        short_variances=_short_variances(passes, segments, covariances, unseen),
    )


def _short_variances(
    passes: Sequence[OdometryPass],
    segments: Sequence[Trajectory],
    covariances: Sequence[PoseCovariances],
    unseen: Unseen,
) -> NDArray[np.float64] | None:
    """Return the mean variances (6,) of poses as seen from those ten metres before."""
    parts = [
        p.short_covariances(s) + unseen.short(c.times, s)
        for p, s, c in zip(passes, segments, covariances, strict=True)
    ]
    variances = np.einsum("kii->ki", np.concatenate(parts))
    return variances.mean(axis=0) if len(variances) else None


def _since(windows: Sequence[WindowRecord], first_turn: float, gap: float) -> float:
    """Return from when on a direction unseen says something about the surroundings, s.

    Until the head has turned, and until surfaces are old enough to be matched with newer ones, there
    is little to match anywhere.
    """
    return max(first_turn, windows[0].time + gap) if windows else first_turn


def _notes(windows: Sequence[WindowRecord], first_turn: float) -> list[str]:
    if not any(w.degenerate and w.time <= first_turn for w in windows):
        return []
    return [
        f"the head had turned once by {first_turn:.1f} s: until then the lidar saw single planes and "
        "the IMU carried the position, as always at the start"
    ]


def _health(
    windows: Sequence[WindowRecord], n_blind: int, *, since: float, has_imu: bool
) -> list[str]:
    sentences = unseen_sentences(windows, since=since, has_imu=has_imu)
    # The trajectory is carried a little beyond the last stamps, always without data.
    if n_blind * DT > 2 * MARGIN:
        sentences.append(
            f"{n_blind * DT:.2f} s have no inertial data: the motion went on at constant velocity there"
        )
    return sentences
