# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a trajectory moves as the gyro and the accelerometer say, apart from each other."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.closing.global_registration.biases import drift_of, has_inertial_states
from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.stretches import over_time
from bentwing.evaluate.verdict.usual import usual_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.verdict.inertial_track import InertialTrack
    from bentwing.evaluate.verdict.usual import Usual
    from bentwing.recording.sections.imu import Imu

    Array = NDArray[np.float64]

STEP = 0.5
"""s, over which turns and changes of velocity are compared."""
_SAMPLES = 50
_FEWEST = 6  # steps that say something
_EXPLAINED = 0.5  # of the squared residuals is left where a scale explains them
# Of the acceleration; a path that is longer than twice what it should be is noise of the poses.
_MOST = 0.5


@dataclass(frozen=True, slots=True)
class Steps:
    """What is left between trajectory and IMU, step by step, map frame.

    Attributes
    ----------
    times : (K,) s, middle of the steps
    rates : (K, 3) rad/s, by which the trajectory turns otherwise than the gyro says
    forces : (K, 3) m/s², by which it accelerates otherwise than the accelerometer says
    accelerations : (K, 3) m/s², of the trajectory
    up : (K, 3) m/s², mean measured force
    """

    times: Array
    rates: Array
    forces: Array
    accelerations: Array
    up: Array


def judge_inertial(estimate: Estimate, track: InertialTrack, imu: Imu | None) -> list[Evidence]:
    """Compare the trajectory with the inertial samples, in units of what both are usually off."""
    if imu is None:
        return []
    sigmas = _Sigmas.of(imu, usual_of(estimate.windows))
    parts = [_steps(part, estimate, track, sigmas) for part in _covered(estimate, track)]
    if sum(len(part.times) for part in parts) < _FEWEST:
        return []
    times, rates, forces, accelerations, up = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("times", "rates", "forces", "accelerations", "up")
    )
    gravity = float(np.linalg.norm(up.mean(axis=0)))
    return [
        _evidence("gyro", times, rates, sigmas.rate, {"degrees": float(np.degrees(_rms(rates)))}),
        _evidence("accelerometer", times, forces, sigmas.force, {"force": _rms(forces)}),
        Evidence("gravity", abs(gravity - STANDARD_GRAVITY)),
        _scale(forces, accelerations),
    ]


def _scale(forces: Array, accelerations: Array) -> Evidence:
    """Judge by how much too long the trajectory is, where that explains how it moves otherwise."""
    share = float((forces * accelerations).sum() / max(float((accelerations**2).sum()), 1e-12))
    left = float(((forces - share * accelerations) ** 2).sum())
    explains = left < _EXPLAINED * float((forces**2).sum()) and abs(share) < _MOST
    times = 1.0 / (1.0 - share) if explains else 1.0
    return Evidence("scale", abs(times - 1.0), (), {"times": times})


@dataclass(frozen=True, slots=True)
class _Sigmas:
    """What trajectory and IMU are usually off over a step, rad/s and m/s²."""

    rate: float
    force: float

    @classmethod
    def of(cls, imu: Imu, usual: Usual) -> _Sigmas:
        # A second difference weights the force like a triangle of two steps.
        force = imu.accel_noise * np.sqrt(2.0 / 3.0 / STEP)
        rate = imu.gyro_noise / np.sqrt(STEP)
        return cls(float(np.hypot(rate, usual.rate)), float(np.hypot(force, usual.force)))


def _evidence(
    kind: str, times: Array, residuals: Array, sigma: float, facts: Mapping[str, float]
) -> Evidence:
    found = over_time(times, (residuals**2).mean(axis=1) / sigma**2)
    return Evidence(kind, float(np.sqrt(found.high)), found.spans_over(kind, np.sqrt), facts)


def _rms(residuals: Array) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean()))


def _covered(estimate: Estimate, track: InertialTrack) -> Sequence[Trajectory]:
    """Return the parts of the trajectory without a break, as far as there are inertial samples."""
    table = track.table
    if len(table) < 2:
        return []
    first, last = float(table[0, 0]), float(table[-1, 0])
    spans = [(max(a, first), min(b, last)) for a, b in estimate.spans]
    parts = [estimate.trajectory.within([(a, b)]) for a, b in spans if b > a]
    return [part for part in parts if len(part.times) > 4 * _SAMPLES]


def _steps(part: Trajectory, estimate: Estimate, track: InertialTrack, sigmas: _Sigmas) -> Steps:
    times, quats = part.times, part.quats_xyzw
    middles, dt = 0.5 * (times[1:] + times[:-1]), np.diff(times)[:, None]
    rates, forces = track.means(times)
    gyro_bias, accel_bias = (_bias(estimate, name, middles) for name in ("gyro_bias", "accel_bias"))
    unit = estimate.calibration.unit
    turns = unit.rates(rates, forces, gyro_bias) * dt
    predicted = geometry.multiply(quats[:-1], geometry.exp(turns))
    turned = geometry.log(geometry.multiply(quats[1:], geometry.inverse(predicted)))
    halfway = geometry.multiply(quats[:-1], geometry.exp(0.5 * turns))
    accelerations = geometry.rotate(halfway, unit.forces(forces, accel_bias))
    accelerations[:, 2] -= STANDARD_GRAVITY
    # The last step has no neighbour, and what is left behind it is none.
    starts = np.arange(0, len(times) - _SAMPLES, _SAMPLES, dtype=np.intp)
    moved = _second_differences(part.positions, accelerations, dt, starts)
    travelled = _second_differences(part.positions, np.zeros_like(accelerations), dt, starts)
    n = len(moved)
    turned = np.add.reduceat(turned, starts)[:n] / STEP
    up = np.add.reduceat(geometry.rotate(halfway, forces), starts)[:n] / _SAMPLES
    at, bodies = times[starts[:n]] + 0.5 * STEP, quats[starts[:n] + _SAMPLES // 2]
    keep = _heard(at, track)
    at, turned, moved, travelled, up, bodies = (
        x[keep] for x in (at, turned, moved, travelled, up, bodies)
    )
    turned = _unbiased(turned / sigmas.rate, bodies, estimate, "gyro_bias", sigmas.rate)
    moved = _unbiased(moved / sigmas.force, bodies, estimate, "accel_bias", sigmas.force)
    return Steps(at, turned * sigmas.rate, moved * sigmas.force, travelled, up)


def _second_differences(
    positions: Array, accelerations: Array, dt: Array, starts: NDArray[np.intp]
) -> Array:
    """Accelerations by positions three steps long less those by the IMU (K, 3), m/s²."""
    velocities = np.vstack([np.zeros(3), np.cumsum(accelerations * dt, axis=0)])
    shifts = velocities[:-1] * dt + 0.5 * accelerations * dt**2
    left = (positions - np.vstack([np.zeros(3), np.cumsum(shifts, axis=0)]))[starts]
    second: Array = (left[2:] - 2.0 * left[1:-1] + left[:-2]) / STEP**2
    return second


def _bias(estimate: Estimate, name: str, times: Array) -> Array:
    final: Array = getattr(estimate.calibration, name)
    return final + drift_of(estimate, name, times)


def _heard(times: Array, track: InertialTrack) -> NDArray[np.bool_]:
    """Tell which steps lie beside all silences of the IMU."""
    heard = np.ones(len(times), np.bool_)
    for first, last in track.gaps:
        heard &= (times + 1.5 * STEP < first) | (times - 0.5 * STEP > last)
    return heard


def _unbiased(residuals: Array, quats: Array, estimate: Estimate, name: str, sigma: float) -> Array:
    """Take out what a bias may be off by its standard deviation.

    Without inertial states it may be anything, and the map may be tilted too.

    Parameters
    ----------
    residuals : (K, 3) in units of `sigma`, map frame
    quats : (K, 4) attitude of the IMU
    """
    if not len(residuals):
        return residuals
    bodies = geometry.to_matrices(quats)
    columns, prior = bodies, np.zeros((3, 3))
    if has_inertial_states(estimate):
        prior = np.diag(sigma / np.maximum(np.array(estimate.calibration.std[name]), 1e-9))
    else:
        columns = np.concatenate([bodies, np.broadcast_to(np.eye(3), bodies.shape)], axis=2)
        prior = np.zeros((3, 6))
    rows = np.vstack([columns.reshape(-1, columns.shape[2]), prior])
    fitted = np.linalg.lstsq(rows, np.append(residuals.ravel(), np.zeros(3)), rcond=None)[0]
    return np.asarray(residuals - columns @ fitted)
