# SPDX-License-Identifier: MIT OR Apache-2.0
"""Arguments of `register_window`, checked and as the core takes them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing import _core
from bentwing.base.arguments import finite_array, in_order, instance
from bentwing.base.mount import MotorMount
from bentwing.base.trajectory import Trajectory
from bentwing.odometry.core_states import core_samples
from bentwing.odometry.window_result import FixedView
from bentwing.recording.batches import ImuBatch

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from bentwing.base.calibration import Calibration


# How far a second difference of the poses may reach, in knot intervals, as the core has it.
_REACH = 0.999


@dataclass(frozen=True, slots=True)
class Points:
    """Points of a window: (N, 3) m, (N,) s and rad."""

    points: NDArray[np.float64]
    times: NDArray[np.float64]
    angles: NDArray[np.float64] | None

    @property
    def span(self) -> float:
        """From the first point to the last, s."""
        return float(self.times[-1] - self.times[0])


def checked_points(
    points: ArrayLike,
    times: ArrayLike,
    angles: ArrayLike | None,
    prior: Trajectory,
    calibration: Calibration,
) -> Points:
    """Return the points of a window that lies within the prior."""
    table = finite_array("points", points, None, 3)
    stamps = finite_array("times", times, len(table))
    in_order("times", stamps)
    if not (len(stamps) and prior.covers(stamps[[0, -1]] - calibration.latency).all()):
        msg = "times: expected at least one, and all within the prior trajectory"
        raise ValueError(msg)
    if angles is not None:
        return Points(table, stamps, finite_array("angles", angles, len(table)))
    has_motor = isinstance(calibration.mount, MotorMount)
    if has_motor:
        msg = (
            f"angles: expected the motor's angle at each of the {len(table)} points, got None; "
            "the payload describes an encoder"
        )
        raise ValueError(msg)
    return Points(table, stamps, None)


def prior_samples(prior: Trajectory, knot_interval: float) -> _core.Samples:
    """Return the prior's poses, which have to be at a uniform rate, and dense enough for the knots."""
    remedy = "make one: Trajectory(times, positions, quats_xyzw)"
    try:
        samples = core_samples(instance("prior", prior, Trajectory, remedy))
    except ValueError as error:
        msg = f"prior: {error}"
        raise ValueError(msg) from None
    interval = pose_interval(prior)
    if 2 * interval >= _REACH * knot_interval:
        msg = (
            f"prior: a pose every {interval:.6g} s is too few for knots every {knot_interval:g} s, "
            "between which more than two are needed; resample it, to 100 Hz for instance, with times "
            "in seconds"
        )
        raise ValueError(msg)
    return samples


def pose_interval(prior: Trajectory) -> float:
    """Return the time between the poses, s."""
    return float((prior.times[-1] - prior.times[0]) / (len(prior) - 1))


def inertial_samples(imu: ImuBatch | None) -> _core.Imu | None:
    """Return the inertial samples over a window."""
    if imu is None:
        return None
    batch = instance("imu", imu, ImuBatch, "make one: ImuBatch(times, gyro, accel)")
    times = finite_array("imu.times", batch.times, None)
    in_order("imu.times", times)
    if not len(times):
        msg = "imu: expected samples over the prior, got none; leave it out for a lidar alone"
        raise ValueError(msg)
    return _core.Imu(
        times,
        finite_array("imu.gyro", batch.gyro, len(times), 3),
        finite_array("imu.accel", batch.accel, len(times), 3),
    )


def core_views(views: Iterable[FixedView]) -> list[_core.FixedView]:
    """Return the surfaces of earlier windows."""
    remedy = "give a list of what `WindowResult.fixed_view()` returns"
    if not isinstance(views, Iterable):
        msg = f"fixed_views: expected a list, got {type(views).__name__}; {remedy}"
        raise TypeError(msg)
    return [instance("fixed_views", view, FixedView, remedy).in_core() for view in views]
