# SPDX-License-Identifier: MIT OR Apache-2.0
"""How a payload's lidar is turned, and what it comes to see of the sphere."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.base import geometry
from bentwing.base.mount import MotorMount
from bentwing.recording.described import described_mount

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.flight.plan.patterns import ScanPattern
    from bentwing.recording import Payload

    Array = NDArray[np.float64]

Turned = Literal["motor", "downdraft", "fixed"]
N_ELEVATIONS = 60
"""Rows of the sphere map: bands of 3°; twice as many columns."""
_BEAM_STEP = np.radians(1.0)
_TURN_STEP = np.radians(1.5)
_WHOLE = 0.995  # share of what is seen at all that counts as everything


@dataclass(frozen=True, slots=True)
class Turning:
    """How the lidar is turned.

    Attributes
    ----------
    turned : by a motor with an encoder, by the downdraft with its IMU (about the IMU's z), or not
    axis : (3,) unit vector in the imu frame
    R_imu_lidar : (3, 3) at the encoder's zero
    """

    turned: Turned
    axis: Array
    R_imu_lidar: Array


def turning_of(payload: Payload, pattern: ScanPattern) -> Turning:
    """Tell how a payload's lidar is turned.

    A 2D lidar without an encoder has to be moved with its IMU to see space: it is taken as spun
    about the IMU's z, which is what the downdraft does under a level carrier.
    """
    mount = described_mount(payload)
    if isinstance(mount, MotorMount):
        mount = mount.with_zero_behind_motor()
        R_imu_motor = mount.T_imu_motor.R
        return Turning("motor", R_imu_motor @ mount.axis, R_imu_motor @ mount.T_motor_lidar.R)
    turned: Turned = "fixed" if pattern.n_lines > 1 else "downdraft"
    return Turning(turned, np.array([0.0, 0.0, 1.0]), mount.T_imu_lidar.R)


@dataclass(frozen=True, slots=True)
class Coverage:
    """What is seen after a full turn, imu frame (level carrier).

    Attributes
    ----------
    seen : (E, A) bool, by elevation from the nadir up and azimuth; cells of 3°
    share : of the sphere
    blind_up, blind_down : rad, full angles of the blind cones about the zenith and the nadir
    sweep : rad, turn after which everything was seen once; 0 for a lidar that is fixed
    """

    seen: NDArray[np.bool_]
    share: float
    blind_up: float
    blind_down: float
    sweep: float


def coverage(turning: Turning, pattern: ScanPattern) -> Coverage:
    """Turn the lidar's beams once around and mark where they look."""
    beams = pattern.directions(_BEAM_STEP) @ turning.R_imu_lidar.T
    turns = np.arange(0.0, 2 * np.pi, _TURN_STEP) if turning.turned != "fixed" else np.zeros(1)
    seen = np.zeros((N_ELEVATIONS, 2 * N_ELEVATIONS), bool)
    shares = np.empty(len(turns))
    weights = _cell_weights()
    for k, turn in enumerate(turns):
        quat = geometry.exp(turn * turning.axis)
        _mark(seen, geometry.rotate(np.broadcast_to(quat, (len(beams), 4)), beams))
        shares[k] = float((seen * weights).sum())
    whole = int(np.argmax(shares >= _WHOLE * shares[-1]))
    sweep = 0.0 if turning.turned == "fixed" else float(turns[whole] + _TURN_STEP)
    up, down = _blind(seen[::-1]), _blind(seen)
    return Coverage(seen, float(shares[-1]), up, down, sweep)


def _mark(seen: NDArray[np.bool_], directions: Array) -> None:
    # A beam on the edge between two cells belongs to the one nearer the horizon.
    elevation = (1.0 - 1e-6) * np.arcsin(np.clip(directions[:, 2], -1.0, 1.0))
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    rows, columns = seen.shape
    row = ((elevation / np.pi + 0.5) * rows).astype(np.int64).clip(0, rows - 1)
    column = ((azimuth / (2 * np.pi) + 0.5) * columns).astype(np.int64) % columns
    seen[row, column] = True


def _cell_weights() -> Array:
    """Share of the sphere in each cell (E, 1)."""
    edges = np.sin(np.linspace(-np.pi / 2, np.pi / 2, N_ELEVATIONS + 1))
    return np.diff(edges)[:, None] / (2 * 2 * N_ELEVATIONS)


def _blind(rows: NDArray[np.bool_]) -> float:
    """Full angle, rad, of the cone about a pole, whose rows come first, in which nothing is seen."""
    first = int(np.argmax(rows.any(axis=1))) if rows.any() else N_ELEVATIONS
    return 2.0 * first * np.pi / N_ELEVATIONS
