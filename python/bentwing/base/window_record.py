# SPDX-License-Identifier: MIT OR Apache-2.0
"""What an estimator says of one window, sweep or scan that it registered."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

# None is a value of these, and written; of all other fields it means that they do not apply.
_NULL_OF_WINDOWS = frozenset({"inlier_share", "residual_rms", "weakest_direction"})
_NULL_OF_SCANS = frozenset({"inlier_share", "residual_rms", "registration_rmse"})


@dataclass(frozen=True, slots=True, kw_only=True)
class WindowRecord:
    """A window of the continuous estimator, a sweep of the Kalman filter or a scan of NDT odometry.

    Attributes
    ----------
    time : s, its end
    n_surfels : pieces of surface that its points are compared with
    n_points : points that were registered (filter, NDT)
    n_planar, n_edges : features of the sweep (filter)
    n_matches : pairs of surfaces, or of points and surfaces
    n_fixed_matches : pairs with the fixed views (windows)
    n_line_matches : pairs of edges and lines (filter)
    registered : whether the scan found its place (filter, NDT)
    new_share : share of the features where nothing was seen before (filter)
    inlier_share : share of the matches that agree within two standard deviations
    residual_rms : of the matches, in units of the expected noise
    gyro_rms, accel_rms : residuals of the IMU over a second, in units of what its noise leaves to
        expect; None where the lidar cannot say (windows)
    gyro_correlation, accel_correlation : of residuals half a second apart, mean of the axes, beyond what
        is expected: 0 where the noise is white, towards 1 where it is an error that lasts (windows)
    imu_noise : (2,) rad/s/√Hz and m/s²/√Hz, of gyro and accelerometer, which the window was weighted with:
        as stated, unless its samples contradict that (windows)
    registration_rmse : root mean square distance from the reference, m (filter, NDT; Tazir 2020,
        figure 13)
    iterations : how often the matches were renewed
    converged : whether the last correction was small
    degenerate : whether a direction is hardly seen
    weakest_direction : (6,) rotation first, of a degenerate window
    translation_eigenvalues, rotation_eigenvalues : (3,) how well translation and rotation are seen,
        increasing
    n_blind : samples without inertial data (windows)
    latency, gyro_bias, accel_bias, gravity, extrinsic_translation, extrinsic_quat_xyzw : the slow
        states after the window, and `std` their standard deviations by name, as in `Calibration`
        (windows)
    """

    time: float
    n_surfels: int
    n_points: int | None = None
    n_planar: int | None = None
    n_edges: int | None = None
    n_matches: int
    n_fixed_matches: int | None = None
    n_line_matches: int | None = None
    registered: bool | None = None
    new_share: float | None = None
    inlier_share: float | None
    residual_rms: float | None
    gyro_rms: float | None = None
    accel_rms: float | None = None
    gyro_correlation: float | None = None
    accel_correlation: float | None = None
    imu_noise: list[float] | None = None
    registration_rmse: float | None = None
    iterations: int
    converged: bool
    degenerate: bool
    weakest_direction: list[float] | None = None
    translation_eigenvalues: list[float] | None = None
    rotation_eigenvalues: list[float] | None = None
    n_blind: int | None = None
    latency: float | None = None
    gyro_bias: list[float] | None = None
    accel_bias: list[float] | None = None
    gravity: list[float] | None = None
    extrinsic_translation: list[float] | None = None
    extrinsic_quat_xyzw: list[float] | None = None
    std: dict[str, list[float]] | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the fields that apply."""
        null = _NULL_OF_WINDOWS if self.registered is None else _NULL_OF_SCANS
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if value is not None or name in null}

    @classmethod
    def from_json(cls, record: dict[str, Any]) -> WindowRecord:
        """Return the record that `to_json` has written; what a later version has added is left out."""
        known = {field.name for field in fields(cls)}
        return cls(**{name: value for name, value in record.items() if name in known})
