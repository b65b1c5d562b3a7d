# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tell from its samples whether an IMU reports m/s² and rad/s, on the same axes.

The accelerometer's unit shows in the length of its median. The gyro's is harder: a payload may
well turn at 6 or even 20 rad/s. Two things are certain: no common gyro measures beyond 35 rad/s
(2000 °/s), and while the head tilts, the direction of gravity turns in the IMU's frame as the
integrated gyro says, in one unit only.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from bentwing.recording.batches import ImuBatch
from bentwing.recording.readings import ACCEL_FACTORS, DEGREE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.recording.batches import Batch
    from bentwing.recording.sections.imu import AccelUnit, ImuUnits

    Samples = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]

CHECKED = 60.0  # s of the recording's beginning; more would not change the judgement
MIN_SAMPLES = 20
QUIET, NO_GRAVITY = 1.0, 0.5  # s; of the median length
MAX_RATE = 35.0  # rad/s, full scale of the fastest common gyros
PLAIN_ACCEL = (9.3, 10.3)  # m/s², median length of an IMU that does not swing
# m/s², median length; 0.3 m off the axis of a spin of 15 rad/s it is seven times gravity.
ACCEL_RANGE = (4.0, 250.0)
# Unit, and the range of the median length that says so.
ACCEL_UNITS: tuple[tuple[AccelUnit, tuple[float, float]], ...] = (
    ("g", (0.5, 2.0)),
    ("cm/s2", (700.0, 990.0)),
    ("milli-g", (990.0, 1500.0)),
)
WINDOW = 0.3  # s over which the turn of gravity and of the gyro are compared
# A reading is believed where it explains half of gravity's turning and four times better than
# the samples as they are.
EXPLAINS, BETTER = 0.5, 0.25
_AS_THEY_ARE = np.eye(3)


def collect(batches: Iterable[Batch], seconds: float = CHECKED) -> Samples:
    """Return times (M,), gyro (M, 3) and accel (M, 3) of the first seconds."""
    parts = beginning(batches, seconds)
    if not parts:
        return np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
    return (
        np.concatenate([part.times for part in parts]),
        np.concatenate([part.gyro for part in parts]),
        np.concatenate([part.accel for part in parts]),
    )


def beginning(batches: Iterable[Batch], seconds: float) -> list[ImuBatch]:
    """Return the batches of the first seconds."""
    parts: list[ImuBatch] = []
    for batch in batches:
        if isinstance(batch, ImuBatch):
            parts.append(batch)
            if batch.times[-1] - parts[0].times[0] >= seconds:
                break
    return parts


def problems(
    times: NDArray[np.float64],
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    units: ImuUnits | None = None,
) -> list[str]:
    """Return what is certainly wrong, each with what to do.

    Parameters
    ----------
    times : (M,) s; gyro : (M, 3); accel : (M, 3), in whatever unit they are
    units : by which the payload has converted them already
    """
    if len(times) < MIN_SAMPLES:
        return []
    found = [_accel_problem(times, accel), _gyro_problem(times, gyro, accel)]
    if units is not None:
        found += [
            _accel_contradiction(accel, units),
            _gyro_contradiction(times, gyro, accel, units),
        ]
    return [problem for problem in found if problem is not None]


def in_si(
    times: NDArray[np.float64], gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return gyro in rad/s and accel in m/s², as far as their units are known."""
    factor = ACCEL_FACTORS[accel_unit(accel) or "m/s2"]
    return gyro * gyro_scale(times, gyro, accel), accel * factor


def accel_unit(accel: NDArray[np.float64]) -> AccelUnit | None:
    """Return the unit of accelerations (M, 3) by their median length; None if it is that of none."""
    length = float(np.median(np.linalg.norm(accel, axis=1))) if len(accel) else 0.0
    if ACCEL_RANGE[0] <= length <= ACCEL_RANGE[1]:
        return "m/s2"
    return next((unit for unit, (low, high) in ACCEL_UNITS if low <= length < high), None)


def lacks_gravity(times: NDArray[np.float64], accel: NDArray[np.float64]) -> bool:
    """Whether the driver has taken gravity off accelerations (M, 3).

    In any unit an accelerometer shows gravity at its quietest as well; without it nearly nothing.
    """
    n = max(1, int(QUIET / max(float(np.median(np.diff(times))), 1e-6)))
    lengths = np.linalg.norm(accel, axis=1)
    usual = float(np.median(lengths)) if len(lengths) else 0.0
    if len(lengths) < n or not 0.0 < usual < ACCEL_RANGE[0]:
        return False
    totals = np.concatenate([[0.0], np.cumsum(lengths)])
    return bool((totals[n:] - totals[:-n]).min() / n < NO_GRAVITY * usual)


def gyro_scale(
    times: NDArray[np.float64], gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> float:
    """Return what makes rad/s of the gyro: 1, or π/180 where it is certainly in deg/s."""
    if len(times) < MIN_SAMPLES:
        return 1.0
    is_fast = _fast_rate(gyro) > MAX_RATE
    return DEGREE if is_fast or GravityWindows(times, gyro, accel).explained_by(DEGREE) else 1.0


def _fast_rate(gyro: NDArray[np.float64]) -> float:
    return float(np.percentile(np.linalg.norm(gyro, axis=1), 99))


def _accel_problem(times: NDArray[np.float64], accel: NDArray[np.float64]) -> str | None:
    length = float(np.median(np.linalg.norm(accel, axis=1)))
    if lacks_gravity(times, accel):
        return (
            f"the accelerations lack gravity (median length {length:.2g}, expected 9.8 m/s²), which the "
            "driver takes off; let it give the raw accelerations, without gravity nothing says what is up"
        )
    if ACCEL_RANGE[0] <= length <= ACCEL_RANGE[1]:
        return None
    if length == 0.0:
        return "the accelerations are all zero; switch the accelerometer on in the driver"
    for unit, (low, high) in ACCEL_UNITS:
        if low <= length < high:
            return (
                f"the accelerations are in {unit.replace('2', '²')} (median length {length:.4g}, "
                f"expected 9.8 m/s²); say so in the payload with 'imu: {{units: {{accel: {unit}}}}}', or multiply by "
                f"{ACCEL_FACTORS[unit]:g} in the driver"
            )
    return (
        f"the accelerations have a median length of {length:.4g}, expected 9.8 m/s²; check the "
        "unit and scale in the driver"
    )


def _gyro_problem(
    times: NDArray[np.float64], gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> str | None:
    fast = _fast_rate(gyro)
    repair = "say so in the payload with 'imu: {units: {gyro: deg/s}}', or multiply by 0.0174533 in the driver"
    if fast > MAX_RATE:
        return (
            f"the angular rates are in deg/s (up to {fast:.4g}, no common gyro measures beyond "
            f"{MAX_RATE:g} rad/s); {repair}"
        )
    windows = GravityWindows(times, gyro, accel)
    if windows.explained_by(DEGREE):
        return f"the angular rates are in deg/s (gravity turns as slowly in the accelerations); {repair}"
    return None


def _accel_contradiction(accel: NDArray[np.float64], units: ImuUnits) -> str | None:
    """Return the sentence on accelerations that were in m/s² before the payload converted them."""
    given = float(np.median(np.linalg.norm(accel, axis=1))) / ACCEL_FACTORS[units.accel]
    if units.accel == "m/s2" or not PLAIN_ACCEL[0] < given < PLAIN_ACCEL[1]:
        return None
    return (
        f"the payload says that the accelerations are in {units.accel}, but their median length of "
        f"{given:.3g} is gravity in m/s²; remove imu.units.accel"
    )


def _gyro_contradiction(
    times: NDArray[np.float64],
    gyro: NDArray[np.float64],
    accel: NDArray[np.float64],
    units: ImuUnits,
) -> str | None:
    """Return the sentence on rates that were in rad/s before the payload converted them."""
    if units.gyro == "rad/s" or not GravityWindows(times, gyro, accel).explained_by(1 / DEGREE):
        return None
    return (
        "the payload says that the angular rates are in deg/s, but gravity turns in the accelerations "
        "as in rad/s; remove imu.units.gyro"
    )


def mirrored_axis(
    times: NDArray[np.float64], gyro: NDArray[np.float64], accel: NDArray[np.float64]
) -> str | None:
    """Return a sentence where gravity turns as if an axis of the gyro were mirrored.

    No ground to refuse a recording: an IMU swung fast below its pivot feels its own acceleration
    more than gravity, and that turns the other way.

    Parameters
    ----------
    times : (M,) s; gyro : (M, 3) rad/s; accel : (M, 3), any unit
    """
    if len(times) < MIN_SAMPLES:
        return None
    windows = GravityWindows(times, gyro, accel)
    mirrored = [
        signs
        for signs in itertools.product((1.0, -1.0), repeat=3)
        if -1.0 in signs and windows.explained_by(1.0, np.diag(signs))
    ]
    if not mirrored:
        return None
    best = min(mirrored, key=lambda signs: windows.residual(1.0, np.diag(signs)))
    names = " and ".join(name for name, sign in zip("xyz", best, strict=True) if sign < 0)
    return (
        f"gyro and accelerometer seem to disagree about the direction of axis {names}; if the head "
        f"was not swung like a pendulum, flip the sign of {names} in one of them with imu.gyro_axes or "
        "imu.axes of the payload"
    )


class GravityWindows:
    """Short windows with the direction of gravity at both ends and the gyro between.

    `starts`, `ends`: (W, 3) unit vectors, imu frame; `steps`: (K, W, 3) rotation vectors of the
    gyro, K samples per window; `at_rest`, `as_they_are`: residuals of no turn and of the samples.
    """

    def __init__(
        self,
        times: NDArray[np.float64],
        gyro: NDArray[np.float64],
        accel: NDArray[np.float64],
    ) -> None:
        dt = float(np.median(np.diff(times)))
        n_window = max(2, round(WINDOW / dt))
        n_average = max(1, round(WINDOW / 3 / dt)) | 1
        kernel = np.ones(n_average) / n_average
        smooth = np.column_stack([np.convolve(accel[:, i], kernel, "same") for i in range(3)])
        directions = smooth / np.maximum(np.linalg.norm(smooth, axis=1, keepdims=True), 1e-9)
        first = np.arange(n_average, len(times) - n_window - n_average, max(1, n_window // 2))
        first = first[times[first + n_window] - times[first] < 2 * WINDOW]
        self.starts, self.ends = directions[first], directions[first + n_window]
        mid_rates = (gyro[:-1] + gyro[1:]) / 2 * np.diff(times)[:, None]
        self.steps = mid_rates[first[None, :] + np.arange(n_window)[:, None]]
        self.at_rest, self.as_they_are = self.residual(0.0), self.residual(1.0)

    def residual(self, scale: float, axes: NDArray[np.float64] = _AS_THEY_ARE) -> float:
        """Return the sum of squared differences between gravity as measured and as turned.

        Parameters
        ----------
        scale : of the gyro
        axes : (3, 3) that take the gyro's samples to the accelerometer's axes
        """
        predicted = self.starts
        for step in scale * self.steps @ axes.T:
            predicted = _turned_back(predicted, step)
        return float(((predicted - self.ends) ** 2).sum())

    def explained_by(self, scale: float, axes: NDArray[np.float64] = _AS_THEY_ARE) -> bool:
        """Whether this reading of the gyro explains how gravity turns, and the plain one does not."""
        residual = self.residual(scale, axes)
        return residual < EXPLAINS * self.at_rest and residual < BETTER * self.as_they_are


def _turned_back(
    vectors: NDArray[np.float64], rotations: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(W, 3) fixed directions as seen from a frame that has turned by (W, 3) rotation vectors."""
    angles = np.linalg.norm(rotations, axis=1, keepdims=True)
    axes = rotations / np.maximum(angles, 1e-12)
    along = (vectors * axes).sum(axis=1, keepdims=True) * axes
    (ax, ay, az), (vx, vy, vz) = axes.T, vectors.T  # np.cross takes longer than all the rest
    turn = np.stack([ay * vz - az * vy, az * vx - ax * vz, ax * vy - ay * vx], axis=1)
    # Rodrigues' formula with the negative angle.
    across = np.cos(angles) * (vectors - along) - np.sin(angles) * turn
    return np.asarray(along + across)
