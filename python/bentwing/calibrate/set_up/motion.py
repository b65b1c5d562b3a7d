# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the lidar moves by itself: angular rates and accelerations from its own odometry."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base import geometry
from bentwing.base.trajectory import DT
from bentwing.calibrate.set_up import edits
from bentwing.odometry.continuous.estimator import Continuous
from bentwing.recording.sections.section import Transform

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bentwing.base.window_record import WindowRecord
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.recording import Payload

HALF = 0.05  # s on both sides over which rates are averaged
LONG_HALF = 0.4  # s, for accelerations: the lidar's positions are no better than millimetres
SETTLING = 1.0  # s until the odometry has something to match with


@dataclass(frozen=True, slots=True)
class LidarMotion:
    """Motion of the lidar, or of the motor that turns it, in a map of its own.

    Attributes
    ----------
    times : (N,) s, lidar clock
    R : (N, 3, 3) rotation to the map
    rates : (N, 3) rad/s, lidar frame
    accelerations : (N, 3) m/s², map
    windows : what the odometry says of itself
    """

    times: NDArray[np.float64]
    R: NDArray[np.float64]
    rates: NDArray[np.float64]
    accelerations: NDArray[np.float64]
    windows: tuple[WindowRecord, ...]


def lidar_motion(stretch: Stretch, payload: Payload, threads: int | None = None) -> LidarMotion:
    """Follow the lidar without the IMU.

    Parameters
    ----------
    payload : its encoder is used if it has one

    Raises
    ------
    EstimationError
        The lidar cannot be followed by itself.
    """
    alone = _alone(payload)
    engine = Continuous(alone, threads=threads)
    for batch in stretch.preprocessed(alone):
        if hasattr(batch, "points"):
            engine.feed(batch)
    found = engine.result()
    trajectory = found.trajectory
    short, long = round(HALF / DT), round(LONG_HALF / DT)
    quats, positions = trajectory.quats_xyzw, trajectory.positions
    turns = geometry.multiply(geometry.inverse(quats[: -2 * short]), quats[2 * short :])
    rates = geometry.log(turns) / (2 * short * DT)
    bends = positions[2 * long :] - 2 * positions[long:-long] + positions[: -2 * long]
    inner = slice(long, -long)
    times = trajectory.times[inner]
    settled = times > times[0] + SETTLING
    return LidarMotion(
        times[settled],
        geometry.to_matrices(quats[inner][settled]),
        rates[long - short : len(rates) - (long - short)][settled],
        (bends / (long * DT) ** 2)[settled],
        tuple(found.windows),
    )


def _alone(payload: Payload) -> Payload:
    """Return the payload of the lidar and its motor, without the IMU that carries them."""
    bare = payload.model_copy(update={"imu": None, "T_imu_lidar": None})
    return bare if bare.encoder is None else edits.with_encoder(bare, T_imu_motor=Transform())
