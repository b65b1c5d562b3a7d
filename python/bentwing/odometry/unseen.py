# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is wrong with all poses alike, so that no residual shows it: it adds to their covariances.

All ranges of a lidar may be longer by a share, and so is the map; what they err by on a surface goes on with
all of its returns, and beams that point elsewhere make a plane a slope. An accelerometer that errs by more than
its noise tilts the map. The axes of an IMU lean in its housing, and the frame of the estimate is that of
the gyro: all attitudes and the mount are turned against the housing, the map is not. And where the IMU is on its head is
seen by forces, to which vibration adds.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.covariances import PoseCovariances, short_pairs
from bentwing.base.mount import MotorMount
from bentwing.odometry import unseen_effects

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.recording.payload import Payload
    from bentwing.recording.sections.imu import Imu

    Array = NDArray[np.float64]
    Std = Mapping[str, Sequence[float]]

RANGE_SCALE = 5e-4
"""Of the ranges, one standard deviation: clocks of rangefinders and air are no better known."""

# Of the noise of ranges, what all returns of a surface share; it turns a lidar whose surroundings are
# so far away, m. Measured with `python -m benches deviations`, as is the next one.
_COMMON_SHARE, _AWAY = 0.07, 5.0
# rad, of the heading beside the angle of a motor: play, and what is left of an eccentric disc.
_PLAY = 7e-4

# Data sheets state what no unit of a series exceeds. Before its motion shows more, a unit is taken to
# lean by this share of it, which counts as much as one entry that is known.
_USUAL_SHARE = 0.15
# An entry that is found is that of an axis and of the frame; and a variance is larger in the mean than what few
# entries show.
_OF_ENTRIES = 0.75
_OFF_DIAGONAL = ~np.eye(3, dtype=bool)


def frame_std(calibration: Calibration, std: Std, imu: Imu | None) -> float:
    """Return by how much the frame of an IMU is turned in its housing about each axis, rad.

    What can be seen of a unit is how its axes lean to each other. It tells how large that is in the
    directions that cannot be seen.

    Parameters
    ----------
    std : of the states of the unit, as far as they are estimated
    imu : says how much its axes may lean; without one the frame is that of the lidar
    """
    if imu is None:
        return 0.0
    stated, unit = imu.errors_expected["gyro_misalignment"], calibration.unit
    if stated == 0.0:
        return 0.0
    known = {
        "gyro_misalignment": np.array([unit.gyro[place] for place in unit.misalignments]),
        "accel_misalignment": unit.accel[_OFF_DIAGONAL],
    }
    weights, squares = 1.0, (_USUAL_SHARE * stated) ** 2
    for name, found in known.items():
        if name in std:
            weight = np.clip(1.0 - np.square(np.array(std[name]) / stated), 0.0, 1.0)
            weights += float(weight.sum())
            squares += _OF_ENTRIES * float(weight @ found**2)
    return float(np.sqrt(squares / weights))


def _nowhere() -> Array:
    return np.zeros((3, 3))


def with_frame(std: Std, frame: float) -> dict[str, list[float]]:
    """Return standard deviations of a calibration with the frame of the IMU turned by `frame`, rad."""
    turned = {
        name: np.hypot(std[name], frame).tolist() for name in ("extrinsic_rotation",) if name in std
    }
    return {**std, **turned}


def with_lever(std: Std, lever: Array) -> dict[str, list[float]]:
    """Return standard deviations of a calibration with a covariance (3, 3) of its lever arm added, m²."""
    name, added = "extrinsic_translation", np.sqrt(np.diag(lever))
    known = {state: [*values] for state, values in std.items()}
    if name in known:
        known[name] = np.hypot(known[name], added).tolist()
    return known


def unexplained_tilt(windows: Sequence[WindowRecord], imu: Imu | None) -> float:
    """Return by how much a force turns the map that is as large as the unexplained residuals, rad.

    Residuals of the accelerometer are means over one second, smoothly weighted, over the noise of these.
    """
    shown = [w for w in windows if w.accel_rms is not None]
    if imu is None or not shown:
        return 0.0
    noise = [imu.accel_noise if w.imu_noise is None else w.imu_noise[1] for w in shown]
    squares = np.square(np.array([w.accel_rms for w in shown], dtype=np.float64))
    beyond = max(0.0, float((np.square(noise) @ squares) - np.sum(np.square(noise))) / len(shown))
    return float(np.sqrt(1.5 * beyond)) / STANDARD_GRAVITY


@dataclass(frozen=True, slots=True)
class Unseen:
    """Adds to covariances of poses.

    Attributes
    ----------
    frame : rad, of the frame of the IMU about each of its axes
    tilt : rad, of gravity in the frame of the IMU about each of its axes
    slope : of what seems level, rad
    place : m, of each position
    turn, heading : rad, of each attitude, and of its heading besides
    lever : (3, 3) m², covariance of where the IMU is on its head, IMU frame
    in_map : whether the poses are those in a given map, which has a scale, a heading and a vertical
    """

    frame: float = 0.0
    tilt: float = 0.0
    slope: float = 0.0
    place: float = 0.0
    turn: float = 0.0
    heading: float = 0.0
    lever: Array = field(default_factory=_nowhere)
    in_map: bool = False

    @classmethod
    def of(
        cls,
        frame: float,
        calibration: Calibration,
        windows: Sequence[WindowRecord],
        payload: Payload,
        *,
        lever: Array,
        in_map: bool = False,
    ) -> Unseen:
        """Return what is unseen of an estimate by what it has seen."""
        common, beams = _COMMON_SHARE * payload.lidar.range_sigma, payload.lidar.beams
        elevations = [] if beams is None else beams.elevations
        return cls(
            frame,
            tilt=unexplained_tilt(windows, payload.imu),
            slope=float(np.sqrt(np.mean(np.square(elevations)))) if len(elevations) else 0.0,
            place=common,
            turn=common / _AWAY,
            heading=_PLAY if isinstance(calibration.mount, MotorMount) else 0.0,
            lever=lever,
            in_map=in_map,
        )

    def covariances(self, found: PoseCovariances, trajectory: Trajectory) -> PoseCovariances:
        """Return those relative to the first pose with what is unseen."""
        n = len(found.times)
        if not n:
            return found
        added = self._added(trajectory, found.times, np.zeros(n, dtype=np.intp), np.arange(n))
        return PoseCovariances(found.times, found.matrices + added)

    def short(self, times: Array, trajectory: Trajectory) -> Array:
        """Return what adds to the covariances (M, 6, 6) of poses as seen from those ten metres before."""
        pairs = short_pairs(times, trajectory.interpolate(times)[0])
        return self._added(trajectory, times, *pairs.T)

    def _added(
        self,
        trajectory: Trajectory,
        times: Array,
        first: NDArray[np.intp],
        last: NDArray[np.intp],
    ) -> Array:
        positions, quats = trajectory.interpolate(times)
        turns, away = geometry.to_matrices(quats), positions[last] - positions[first]
        if self.in_map:
            effects = [self.frame * unseen_effects.of_frame_in_map(turns[last])]
        else:
            effects = [
                self.frame * unseen_effects.of_frame(turns[first], turns[last], away),
                self.tilt * unseen_effects.of_force(turns.mean(axis=0), away),
                self.slope * unseen_effects.of_slope(away),
                RANGE_SCALE * unseen_effects.of_scale(away),
            ]
        together = np.concatenate(effects, axis=2)
        own = np.square([self.turn] * 3 + [self.place] * 3)
        own[2] += self.heading**2
        shared = together @ together.transpose(0, 2, 1) + np.diag(own)
        # The lidar is where it seems to be; the IMU beside it is not.
        moved = turns[last] if self.in_map else turns[last] - turns[first]
        shared[:, 3:, 3:] += moved @ self.lever @ moved.transpose(0, 2, 1)
        return np.asarray(shared)
