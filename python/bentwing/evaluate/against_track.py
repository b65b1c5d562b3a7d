# SPDX-License-Identifier: MIT OR Apache-2.0
"""A trajectory against a reference: total station, motion capture, or the truth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.clock import NS_PER_S
from bentwing.base.errors import InputError
from bentwing.base.trajectory import Trajectory
from bentwing.evaluate.alignment import (
    Alignment,
    align,
    align_poses,
    tells_roll,
    without_frame_rotation,
)
from bentwing.evaluate.relative import (
    RelativeError,
    relative_pose_error,
    rotational_error,
    translational_error,
)
from bentwing.evaluate.robust import Line, fit_line
from bentwing.evaluate.statistics import SAMPLES, Box, Statistics
from bentwing.evaluate.track import bridges
from bentwing.evaluate.tracked_point import TrackedPoint, find_tracked_point, moved_to_point
from bentwing.evaluate.trajectory import angles

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from bentwing.evaluate.track import Track

DELTAS = (1.0, 10.0)  # m, over which relative errors are measured
_SPEED_SPAN = 0.2  # s over which a speed is measured, so that vibration does not count
_FEWEST = 3
_LEAST_CHANGE = 0.05  # of a speed


@dataclass(frozen=True, slots=True)
class RotationError:
    """Errors of orientation after alignment.

    Attributes
    ----------
    as_is : of the angles, rad, as evo has them
    frame_rotation : rad, constant turn between the body frames of estimate and reference
    without_frame : of the angles, rad, without that turn
    """

    as_is: Statistics
    frame_rotation: float
    without_frame: Statistics


@dataclass(frozen=True, slots=True)
class Unaligned:
    """Errors as the coordinates stand, for estimates that claim to be in the frame of the reference.

    Attributes
    ----------
    position : of the distances, m
    axes : x, y, z of the reference's frame, m
    """

    position: Statistics
    axes: dict[str, Box]

    @classmethod
    def of(cls, errors: NDArray[np.float64]) -> Unaligned:
        """Summarize errors (N, 3) m."""
        return cls(Statistics.of(np.linalg.norm(errors, axis=1)), _boxes(errors))


@dataclass(frozen=True, slots=True)
class TrackError:
    """Differences between a trajectory and a reference, estimate minus reference.

    Attributes
    ----------
    tracked_point : clock offset and lever arm
    absolute : of the distances after alignment, m; the absolute trajectory error
    axes : x, y, z of the reference's frame, m
    unaligned : the same without alignment
    error_over_speed : robust line of the distance, m, over the speed, m/s
    relative : over pieces of the way of `DELTAS`
    rotation : None where the reference has no orientations
    rte, rre : of Tazir 2020, with the first poses aligned, m and √2 rad; None likewise
    n_unmatched : measurements outside of the common time or in a silence
    alignment : from the map of the estimate to the frame of the reference
    is_straight : the positions do not tell the turn about the path
    times, errors, speeds : (N,) s since the estimate's time zero, (N, 3) m, (N,) m/s
    estimate, reference : at the common times, the estimate aligned; reference None like `rotation`
    """

    tracked_point: TrackedPoint
    absolute: Statistics
    axes: dict[str, Box]
    unaligned: Unaligned
    error_over_speed: Line | None
    relative: list[RelativeError]
    rotation: RotationError | None
    rte: Statistics | None
    rre: Statistics | None
    n_unmatched: int
    is_straight: bool
    alignment: Alignment = field(metadata=SAMPLES)
    times: NDArray[np.float64] = field(metadata=SAMPLES)
    errors: NDArray[np.float64] = field(metadata=SAMPLES)
    speeds: NDArray[np.float64] = field(metadata=SAMPLES)
    reference: Trajectory | None = field(metadata=SAMPLES)


def compare_with_track(
    estimate: Trajectory,
    clock_origin_ns: int,
    track: Track,
    *,
    clock_offset: float | None = None,
    lever_arm: tuple[float, float, float] | None = None,
    written: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
) -> TrackError:
    """Compare a trajectory with a reference in a frame of its own.

    Errors are measured at the stamps of whichever of both is sparser, the other interpolated
    between its neighbours, after the rigid motion that makes the squares of the distances least.

    Parameters
    ----------
    estimate : poses of the IMU
    clock_origin_ns : absolute stamp of the estimate's time zero
    track : the reference
    clock_offset : s, how far the reference's clock is ahead; None: estimated
    lever_arm : m, tracked point in the IMU frame; None: estimated where the reference has
        positions only, else zero
    written : takes positions (N, 3) m of the estimate to the coordinates that its map is written in

    References
    ----------
    Kaul 2015, section 4.2, figures 19 and 20.
    """
    if lever_arm is None and track.quats_xyzw is not None:
        lever_arm = (0.0, 0.0, 0.0)
    point = find_tracked_point(
        estimate, clock_origin_ns, track, clock_offset=clock_offset, lever_arm=lever_arm
    )
    shift = (track.origin_ns - clock_origin_ns) / NS_PER_S - point.clock_offset
    matched, positions, quats, n_unmatched = _at_common_times(
        moved_to_point(estimate, point.lever_arm), track.moved_in_time(shift)
    )
    reference = None if quats is None else Trajectory(matched.times, positions, quats)
    alignment = (
        align(matched.positions, positions)
        if reference is None
        else align_poses(matched, reference)
    )
    errors = alignment.apply(matched).positions - positions
    as_is = matched.positions if written is None else written(matched.positions)
    distances = np.linalg.norm(errors, axis=1)
    speeds = _speeds(estimate, matched.times)
    relative = [relative_pose_error(matched, positions, quats, delta) for delta in DELTAS]
    return TrackError(
        tracked_point=point,
        absolute=Statistics.of(distances),
        axes=_boxes(errors),
        unaligned=Unaligned.of(as_is - positions),
        error_over_speed=fit_line(speeds, distances) if _varies(speeds) else None,
        relative=[found for found in relative if found is not None],
        rotation=None if reference is None else _rotation(alignment.apply(matched), reference),
        **_errors_of_tazir(matched, reference),
        n_unmatched=n_unmatched,
        is_straight=not tells_roll(alignment, matched.positions, positions),
        alignment=alignment,
        times=matched.times,
        errors=errors,
        speeds=speeds,
        reference=reference,
    )


def _boxes(errors: NDArray[np.float64]) -> dict[str, Box]:
    return {name: Box.of(errors[:, i]) for i, name in enumerate("xyz")}


def _at_common_times(
    estimate: Trajectory, track: Track
) -> tuple[Trajectory, NDArray[np.float64], NDArray[np.float64] | None, int]:
    """Both at the stamps of the sparser one, and how many of these cannot be compared."""
    in_estimate = ~bridges(estimate.times, track.times)
    in_track = ~bridges(track.times, estimate.times)
    if np.count_nonzero(in_estimate) <= np.count_nonzero(in_track):
        times, n_all = track.times[in_estimate], len(track.times)
    else:
        times, n_all = estimate.times[in_track], len(estimate.times)
    if len(times) < _FEWEST:
        msg = (
            f"estimate and reference share {len(times)} stamps, at least {_FEWEST} are needed; is "
            "the clock offset right?"
        )
        raise InputError(msg)
    matched = Trajectory(times, *estimate.interpolate(times))
    if track.quats_xyzw is None:
        along = [np.interp(times, track.times, axis) for axis in track.positions.T]
        return matched, np.stack(along, axis=1), None, n_all - len(times)
    poses = Trajectory(track.times, track.positions, track.quats_xyzw)
    return matched, *poses.interpolate(times), n_all - len(times)


def _speeds(estimate: Trajectory, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Speeds of the platform, `(N,)` m/s."""
    first, last = estimate.times[0], estimate.times[-1]
    begin = np.maximum(times - _SPEED_SPAN / 2, first)
    end = np.minimum(times + _SPEED_SPAN / 2, last)
    moved = estimate.interpolate(end)[0] - estimate.interpolate(begin)[0]
    speeds: NDArray[np.float64] = np.linalg.norm(moved, axis=1) / (end - begin)
    return speeds


def _varies(speeds: NDArray[np.float64]) -> bool:
    """Whether speeds (N,) differ enough to set errors against them."""
    low, high = np.percentile(speeds, [5, 95])
    return bool(high - low > _LEAST_CHANGE * high)


def _rotation(aligned: Trajectory, reference: Trajectory) -> RotationError:
    corrected = without_frame_rotation(aligned, reference)
    return RotationError(
        Statistics.of(angles(reference.quats_xyzw, aligned.quats_xyzw)),
        float(angles(corrected.quats_xyzw[:1], aligned.quats_xyzw[:1])[0]),
        Statistics.of(angles(reference.quats_xyzw, corrected.quats_xyzw)),
    )


def _errors_of_tazir(
    matched: Trajectory, reference: Trajectory | None
) -> dict[str, Statistics | None]:
    if reference is None:
        return {"rte": None, "rre": None}
    turn = geometry.multiply(reference.quats_xyzw[0], geometry.inverse(matched.quats_xyzw[0]))
    moved = geometry.rotate(turn, matched.positions - matched.positions[0])
    quats = geometry.multiply(turn, matched.quats_xyzw)
    return {
        "rte": Statistics.of(
            translational_error(reference.positions, moved + reference.positions[0])
        ),
        "rre": Statistics.of(rotational_error(reference.quats_xyzw, quats)),
    }
