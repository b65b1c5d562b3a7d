# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a global registration says, as an `Estimate` and as a record."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.covariances import PoseCovariances, positive_part, short_pairs
from bentwing.base.trajectory import Trajectory
from bentwing.closing.global_registration.stretches import interval_of
from bentwing.odometry.continuous.slow_states import (
    UNIT_STATES,
    named_std,
    places_of,
)
from bentwing.odometry.core_states import refined
from bentwing.odometry.segments import joined
from bentwing.odometry.unseen import Unseen, frame_std, with_frame, with_lever
from bentwing.odometry.unseen_lever import lever_covariance

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing import _core
    from bentwing.base.estimate import Estimate
    from bentwing.recording import Payload

# Covariances are computed so often, s, but no more than so many: the cost grows with each.
POSE_INTERVAL = 0.5
MOST_POSES = 100
# So much smaller may the share of inliers become by chance.
TOLERATED_LOSS = 0.01


def improved(found: _core.GlobalRegistration) -> str:
    """Return why a result cannot be trusted, or nothing."""
    if not any(i[0] for i in found.iterations):
        return "no surface was seen twice"
    if not found.converged:
        turn, shift = found.iterations[-1][4:]
        return (
            f"the global registration did not settle in {len(found.iterations)} iterations; the "
            f"last one moved the trajectory by {1e3 * shift:.1f} mm and {np.degrees(turn):.3f}°"
        )
    before, after = found.iterations[0][2], found.fit[0]
    if after < before - TOLERATED_LOSS:
        return (
            f"of the matches {before:.1%} fitted before the global registration and {after:.1%} "
            "after it"
        )
    return ""


def closed_estimate(
    estimate: Estimate,
    found: _core.GlobalRegistration,
    segments: Sequence[Trajectory],
    own: slice,
    *,
    payload: Payload,
    has_imu: bool,
    in_map: bool,
) -> Estimate:
    """Return the estimate with corrected segments and calibration.

    Parameters
    ----------
    segments : of the estimate, as they were registered
    own : which pieces of the result they are
    payload : as described
    has_imu : whether there are inertial samples
    in_map : whether they were registered with a given map
    """
    dt = interval_of(estimate)
    moved = [
        Trajectory(s.times, np.asarray(n.positions), np.asarray(n.quats_xyzw))
        for s, n in zip(segments, found.samples[own], strict=True)
    ]
    # Each segment has found a calibration of its own; the longest one knows it best.
    best = int(np.argmax([s.times[-1] - s.times[0] for s in moved]))
    slow, covariance = found.globals[own][best], found.covariances[own][best]
    # What the unit does was held as the open loop knows it.
    frozen = (np.diag(covariance) == 0.0) | places_of(UNIT_STATES)
    corrected, std = refined(estimate.calibration, slow), named_std(covariance, frozen)
    imu = payload.imu if has_imu else None
    frame = frame_std(corrected, estimate.calibration.std, imu)
    trajectory = joined(moved, dt)
    lever = lever_covariance(trajectory, imu)
    calibration = replace(
        corrected, std={**estimate.calibration.std, **with_lever(with_frame(std, frame), lever)}
    )
    unseen = Unseen.of(frame, corrected, estimate.windows, payload, lever=lever, in_map=in_map)
    poses = [
        unseen.covariances(part, segment)
        for part, segment in zip(_poses_of(found, moved, own), moved, strict=True)
    ]
    return replace(
        estimate,
        trajectory=trajectory,
        calibration=calibration,
        covariances=PoseCovariances.joined(poses),
        short_variances=_short_variances(found, moved, poses, own, unseen),
    )


def _poses_of(
    found: _core.GlobalRegistration, segments: Sequence[Trajectory], own: slice
) -> list[PoseCovariances]:
    """Return the covariances of poses evenly along the segments."""
    seconds = sum(float(s.times[-1] - s.times[0]) for s in segments)
    interval = max(POSE_INTERVAL, seconds / MOST_POSES)
    parts = []
    for piece, segment in enumerate(segments, start=own.start):
        first, last = float(segment.times[0]), float(segment.times[-1])
        times = np.linspace(first, last, 1 + max(1, round((last - first) / interval)))
        matrices = positive_part(found.pose_covariances(piece, times.tolist()))
        parts.append(PoseCovariances(times, matrices))
    return parts


def _short_variances(
    found: _core.GlobalRegistration,
    segments: Sequence[Trajectory],
    poses: Sequence[PoseCovariances],
    own: slice,
    unseen: Unseen,
) -> NDArray[np.float64] | None:
    """Return the mean variances (6,) of poses as seen from those ten metres before."""
    variances = []
    for piece, (segment, part) in enumerate(zip(segments, poses, strict=True), start=own.start):
        pairs = part.times[short_pairs(part.times, segment.interpolate(part.times)[0])]
        matrices = positive_part(found.relative_covariances(piece, pairs.tolist()))
        matrices = matrices + unseen.short(part.times, segment)
        variances.append(np.einsum("kii->ki", matrices))
    joined_ones = np.concatenate(variances)
    return joined_ones.mean(axis=0) if len(joined_ones) else None


def record_of(
    found: _core.GlobalRegistration,
    segments: Sequence[Trajectory],
    corrected: Sequence[_core.Samples],
    timings: dict[str, float],
) -> dict[str, Any]:
    """Return what was done, for run.json; lengths in m, angles in rad, times in s."""
    n_unknowns, n_links, n_far_links, n_surfels = found.counts
    names = (
        "n_matches",
        "n_far_matches",
        "inlier_share",
        "residual_rms",
        "rotation",
        "translation",
    )
    pairs = list(zip(segments, corrected, strict=True))
    shifts = [np.linalg.norm(n.positions - s.positions, axis=1).max() for s, n in pairs]
    turns = [_turns(s.quats_xyzw, n.quats_xyzw).max() for s, n in pairs]
    return {
        "n_unknowns": n_unknowns,
        "n_stretch_pairs": n_links,
        "n_revisits": n_far_links,
        "n_surfels": n_surfels,
        "converged": found.converged,
        "iterations": [dict(zip(names, i, strict=True)) for i in found.iterations],
        "inlier_share": found.fit[0],
        "residual_rms": found.fit[1],
        "dispersion": found.dispersion,
        "largest_translation": float(max(shifts)),
        "largest_rotation": float(max(turns)),
        "timings": timings,
    }


def _turns(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    turn = geometry.log(geometry.multiply(after, geometry.inverse(before)))
    return np.asarray(np.linalg.norm(turn, axis=1))
