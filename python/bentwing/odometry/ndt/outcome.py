# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the scans say, as an `Estimate`."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base.estimate import Estimate
from bentwing.base.spans import name_spans, spans_of
from bentwing.base.trajectory import DT, Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.odometry.health import FEW, drift, is_degenerate, unseen_sentence
from bentwing.odometry.ndt.levelling import SPAN, VELOCITY_SPAN
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.breaks import Break
    from bentwing.base.calibration import Calibration
    from bentwing.odometry.ndt.levelling import Frame, Levelling
    from bentwing.odometry.ndt.matching import Match
    from bentwing.odometry.ndt.motion import Track


@dataclass(frozen=True, slots=True)
class Found:
    """What the scans up to one have found; nothing of it changes any more.

    Attributes
    ----------
    tracks : between two of them the place was lost
    stamps : s, of the first return, and up to which there are scans
    calibration : as the payload describes it
    """

    tracks: list[Track]
    stamps: tuple[float, float]
    levelling: Levelling
    calibration: Calibration
    windows: list[WindowRecord]
    breaks: list[Break]
    counts: dict[str, int]
    timings: dict[str, float]

    @property
    def starts(self) -> list[float]:
        """When the tracks begin, s, IMU clock."""
        first = self.stamps[0] - self.calibration.latency
        return [first, *(t.poses[0].time for t in self.tracks[1:])]

    @property
    def ends(self) -> list[float]:
        """When the tracks end, s, IMU clock."""
        last = self.stamps[1] - self.calibration.latency
        return [*(t.last.time for t in self.tracks[:-1]), last]

    @property
    def can_be_level(self) -> bool:
        """Whether there is enough of the beginning to know the vertical."""
        return self.ends[0] - self.starts[0] >= 2 * VELOCITY_SPAN

    @property
    def is_settling(self) -> bool:
        """Whether later scans may still tilt the map."""
        return self.levelling.has_samples and self.ends[0] - self.starts[0] < SPAN

    def parts(self) -> list[Trajectory]:
        """Return the trajectories of the tracks, in the map of the first scan."""
        starts = self.starts
        spans = zip(self.tracks, starts, self.ends, strict=True)
        parts = [track.trajectory(start, end) for track, start, end in spans]
        until = zip(parts[:-1], starts[1:], strict=True)
        return [*(_until(part, start) for part, start in until), parts[-1]]

    def frame(self) -> Frame:
        """Return the level map, by the beginning alone, at a cost that does not grow with time."""
        track, start, end = self.tracks[0], self.starts[0], self.ends[0]
        until = start + SPAN
        # A pose shapes the way as far as to the second one before it.
        shaping = track.sliced(0, bisect_left(track.poses, until, key=lambda pose: pose.time) + 2)
        return self.levelling.frame(shaping.trajectory(start, min(end, until + DT)))


def estimate_of(found: Found) -> Estimate:
    """Return poses over the whole recording, level and from the origin on."""
    frame = found.frame()
    level = [frame.level(part) for part in found.parts()]
    return Estimate(
        joined(level),
        found.calibration,
        windows=found.windows,
        counts=found.counts,
        timings=found.timings,
        health=_health(found.windows),
        breaks=found.breaks,
        segments=[(float(p.times[0]), float(p.times[-1])) for p in level],
    )


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
        degenerate=is_degenerate(shift, turn),
        translation_eigenvalues=list(shift),
        rotation_eigenvalues=list(turn),
    )


def _health(windows: Sequence[WindowRecord]) -> list[str]:
    """Return sentences about what makes the estimate worse than usual."""
    sentences = []
    lost = [(w.time, not w.registered) for w in windows]
    if any(is_lost for _, is_lost in lost):
        sentences.append(
            f"{name_spans(spans_of(lost))} the scans fit nowhere near where they were expected: "
            f"{drift(has_imu=False)}"
        )
    weak = [(w.time, bool(w.registered and w.degenerate)) for w in windows]
    if sum(is_weak for _, is_weak in weak) > FEW * len(windows):
        sentences.append(unseen_sentence(spans_of(weak), has_imu=False))
    return sentences


def _until(part: Trajectory, stop: float) -> Trajectory:
    """Return the poses before another track begins."""
    keep = part.times < stop
    return Trajectory(part.times[keep], part.positions[keep], part.quats_xyzw[keep])
