# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run folder against the truth of its simulated recording."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import Calibration
from bentwing.base.mount import FixedMount
from bentwing.base.run_record import read_record
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated.truth import Truth, mapped_points
from bentwing.evaluate.simulated.unit import in_frame_of, unit_errors
from bentwing.evaluate.trajectory import absolute_error, drift

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Score:
    """Errors of one run.

    Attributes
    ----------
    ate, ate_flight, worst : m; of all poses, in flight, and the largest in flight
    rotation : rad, root mean square in flight without the constant rotation of the IMU frame
    tilt : rad, of the map against gravity
    horizontal, vertical : m per m, median drift over 10 m in flight; None where it is shorter
    map_std, map_ratio : m; and over that of the map made with the truth
    map_excluded : share of points on no surface
    latency : s
    extrinsic_rotation, extrinsic_translation : rad, m, in the frame of the gyro; None with a motor
    gyro_bias, accel_bias : rad/s, m/s², against the truth at the end under the force at the start
    normalized : errors of the slow states over their stated standard deviations, by axis
    """

    ate: float
    ate_flight: float
    worst: float
    rotation: float
    tilt: float
    horizontal: float | None
    vertical: float | None
    map_std: float
    map_ratio: float
    map_excluded: float
    latency: float
    extrinsic_rotation: float | None
    extrinsic_translation: float | None
    gyro_bias: float
    accel_bias: float
    normalized: dict[str, list[float]]

    def as_dict(self) -> dict[str, Any]:
        """Return plain JSON types."""
        return asdict(self)


def score(simulated: Path, run: Path) -> Score:
    """Compare what `bentwing map` left in `run` with the truth in the folder `simulated`."""
    truth = Truth(simulated)
    estimate, _ = read_tum(run / "trajectory.txt", truth.origin_ns)
    whole = absolute_error(estimate, truth.trajectory)
    flown = absolute_error(estimate, truth.trajectory, during=truth.flight)
    drifts = drift(estimate, truth.trajectory, during=truth.flight)
    R, t = flown.alignment.R, flown.alignment.t
    points = mapped_points(run / "map.laz", truth.origin_ns, truth.flight)
    surface = truth.map_error(points @ R.T + t)
    found = Calibration.from_json(read_record(run)["calibration"])
    true = in_frame_of(found, truth.calibration, truth.imu_response)
    errors = _calibration_errors(found, true)
    return Score(
        ate=whole.position.rmse,
        ate_flight=flown.position.rmse,
        worst=flown.position.maximum,
        rotation=flown.rotation.rmse,
        tilt=float(np.arccos(np.clip(R[2, 2], -1.0, 1.0))),
        horizontal=drifts[0].horizontal_median if drifts else None,
        vertical=drifts[0].vertical_median if drifts else None,
        map_std=surface.std,
        map_ratio=surface.best_ratio or np.nan,
        map_excluded=surface.n_excluded / surface.n_points,
        latency=float(errors["latency"][0]),
        extrinsic_rotation=_norm(errors.get("extrinsic_rotation")),
        extrinsic_translation=_norm(errors.get("extrinsic_translation")),
        gyro_bias=float(np.linalg.norm(errors["gyro_bias"])),
        accel_bias=float(np.linalg.norm(errors["accel_bias"])),
        normalized={
            name: np.divide(error, found.std[name]).tolist()
            for name, error in errors.items()
            if name in found.std
        },
    )


def _calibration_errors(found: Calibration, true: Calibration) -> dict[str, Array]:
    """Found minus true, by the names and in the units of the standard deviations."""
    errors = {
        "latency": np.array([found.source_latency - true.source_latency]),
        "gyro_bias": found.gyro_bias - true.gyro_bias,
        "accel_bias": found.accel_bias - true.accel_bias,
        **unit_errors(found.unit, true.unit),
    }
    if isinstance(found.mount, FixedMount) and isinstance(true.mount, FixedMount):
        pose, truly = found.mount.T_imu_lidar, true.mount.T_imu_lidar
        turn = geometry.multiply(pose.quaternion, geometry.inverse(truly.quaternion))
        errors["extrinsic_rotation"] = geometry.log(turn)
        errors["extrinsic_translation"] = pose.translation - truly.translation
    return errors


def _norm(error: Array | None) -> float | None:
    return None if error is None else float(np.linalg.norm(error))
