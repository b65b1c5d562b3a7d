# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the scans say, as an `Estimate`."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY, Calibration
from bentwing.base.trajectory import DT, Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.mount import Mount
    from bentwing.odometry.ndt.levelling import Levelling
    from bentwing.odometry.ndt.matching import Match
    from bentwing.odometry.ndt.motion import Track

# A scan is degenerate when it says so much less, as a share of all, about its translation or its
# rotation in one direction: the surfaces it sees could be shifted or turned along themselves.
LEAST_SHARE = 5e-4
# More of the scans than this are worth a sentence.
FEW = 0.02


def calibration_of(mount: Mount) -> Calibration:
    """Return the calibration as the payload has it; NDT odometry estimates nothing of it."""
    up = np.array([0.0, 0.0, STANDARD_GRAVITY])
    return Calibration(0.0, mount, np.zeros(3), np.zeros(3), up)


def levelled_trajectory(
    tracks: list[Track], span: tuple[float, float], levelling: Levelling
) -> tuple[Trajectory, list[tuple[float, float]]]:
    """Poses over the whole recording, level and from the origin on, and the span of each track."""
    starts = [span[0], *(t.poses[0].time for t in tracks[1:])]
    stops = [*(t.last.time for t in tracks[:-1]), span[1]]
    parts = [t.trajectory(a, b) for t, a, b in zip(tracks, starts, stops, strict=True)]
    parts = [
        *(_until(p, start) for p, start in zip(parts[:-1], starts[1:], strict=True)),
        parts[-1],
    ]
    turn, origin = levelling.turn(parts[0]), parts[0].positions[0]
    level = [
        Trajectory(
            p.times,
            geometry.rotate(turn, p.positions - origin),
            geometry.multiply(turn, p.quats_xyzw),
        )
        for p in parts
    ]
    segments = [(float(p.times[0]), float(p.times[-1])) for p in level]
    return joined(level, DT), segments


def record_of(time: float, n_surfaces: int, match: Match | None) -> WindowRecord:
    """Return the record of a scan, as `Estimate.windows` holds it."""
    if match is None:
        return WindowRecord(
            time=time, n_surfels=n_surfaces, n_points=0, n_matches=0, registered=False,
            inlier_share=None, residual_rms=None, iterations=0, converged=False, degenerate=True,
        )  # fmt: skip
    found = match.registration
    shift, turn = found.translation_eigenvalues, found.rotation_eigenvalues
    return WindowRecord(
        time=time,
        n_surfels=n_surfaces,
        n_points=match.n_points,
        n_matches=found.n_matched,
        registered=True,
        inlier_share=found.inlier_share,
        residual_rms=found.residual_rms,
        registration_rmse=found.rmse,
        iterations=found.n_iterations,
        converged=found.converged,
        degenerate=min(shift[0], turn[0]) < LEAST_SHARE,
        translation_eigenvalues=list(shift),
        rotation_eigenvalues=list(turn),
    )


def health_of(windows: Sequence[WindowRecord]) -> list[str]:
    """Return sentences about what makes the estimate worse than usual."""
    sentences = []
    lost = [w.time for w in windows if not w.registered]
    if lost:
        sentences.append(
            f"{len(lost)} of {len(windows)} scans fit nowhere near where they were expected "
            f"(first at {lost[0]:.1f} s): the motion went on at constant velocity there"
        )
    weak = [w.time for w in windows if w.registered and w.degenerate]
    if len(weak) > FEW * len(windows):
        sentences.append(
            f"{len(weak)} of {len(windows)} scans see too little in some direction (first at "
            f"{weak[0]:.1f} s): there the trajectory goes on as before, which drifts"
        )
    return sentences


def _until(part: Trajectory, stop: float) -> Trajectory:
    """Return the poses before another track begins."""
    keep = part.times < stop
    return Trajectory(part.times[keep], part.positions[keep], part.quats_xyzw[keep])
