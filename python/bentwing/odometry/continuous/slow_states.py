# SPDX-License-Identifier: MIT OR Apache-2.0
"""The slow states of the continuous estimator: their places, priors and carried information."""

from __future__ import annotations

from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.calibration import STANDARD_GRAVITY
from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.recording.sections.imu import Imu

    Stated = Mapping[str, Sequence[float]]

N_STATES = 57
# Order of the core's `registration::index`.
SLICES = {
    "encoder_zero": slice(0, 1),
    "motor_tilt": slice(1, 3),
    "motor_offset": slice(3, 5),
    "encoder_eccentricity": slice(5, 7),
    "motor_wobble": slice(7, 15),
    "latency": slice(15, 16),
    "latency_rate": slice(16, 17),
    "extrinsic_rotation": slice(17, 20),
    "extrinsic_translation": slice(20, 23),
    "range_offset": slice(23, 24),
    "range_grazing": slice(24, 25),
    "gyro_bias": slice(25, 28),
    "accel_bias": slice(28, 31),
    "gravity": slice(31, 33),
    "gyro_scale": slice(33, 36),
    "gyro_misalignment": slice(36, 39),
    "g_sensitivity": slice(39, 48),
    "accel_scale": slice(48, 51),
    "accel_misalignment": slice(51, 57),
}
UNIT_STATES = (
    "gyro_scale", "gyro_misalignment", "g_sensitivity", "accel_scale", "accel_misalignment",
)  # fmt: skip
MOTOR_STATES = (
    "encoder_zero", "motor_tilt", "motor_offset", "encoder_eccentricity", "motor_wobble",
)  # fmt: skip
RANGE_STATES = ("range_offset", "range_grazing")

# Standard deviations before anything was measured: s, rad, m, rad/s, m/s², rad, rad, rad, m, s/s. Two
# crystals are up to 20 ppm off each. Where little shows the rate, no more of it should be believed.
# Discs of encoders are off their axes by up to 0.1°, and shafts wobble by 0.02° to 0.1°.
# Rangefinders are right to ± 10 to 30 mm, and echoes late by a tenth to a third of a beam of 3 mrad.
INITIAL_STD = {
    "latency": 3e-3,
    "extrinsic_rotation": 9e-3,
    "extrinsic_translation": 5e-3,
    "gyro_bias": 2.5e-4,
    "accel_bias": 0.04,
    "gravity": 0.02,
    "encoder_zero": 9e-3,
    "motor_tilt": 9e-3,
    "motor_offset": 3e-3,
    "encoder_eccentricity": 1e-3,
    "motor_wobble": 5e-4,
    "latency_rate": 2e-5,
    "range_offset": 0.02,
    "range_grazing": 7e-4,
}
# States of which a payload may state that they are less certain.
DESCRIBED = (
    "latency", "extrinsic_rotation", "extrinsic_translation", "motor_tilt", "motor_offset",
)  # fmt: skip
MOVING_START_STD = {"gyro_bias": 0.01, "accel_bias": 0.05, "gravity": 0.2}
# Random walks, per √s: clocks drift, mounts give way and warm up. In ten minutes 0.25 ms, 0.006° and
# half a millimetre: no model is right to less.
WALK = {
    "latency": 1e-5,
    "extrinsic_rotation": 4e-6,
    "extrinsic_translation": 2e-5,
    "accel_bias": 3e-4,
}

# A carrier may still settle when it seems to rest, m/s².
MIN_REST_STD = 2e-3

# The matches of a surface share its noise and its curvature: so large a share of what a window says
# of the slow states counts. Measured: with it errors are about as large as stated.
MATCH_INDEPENDENCE = 0.4

# Errors of matches repeat with each turn of the head, as do the rates that show what the unit does: they
# average out less than others. Measured with `python -m benches realism`, over the seeds of its default.
REPEATED = 1.7


def initial_std(*, moving: bool, stated: Stated = MappingProxyType({})) -> dict[str, float]:
    """Return the standard deviations before anything was measured, at rest or in motion.

    Parameters
    ----------
    stated : of latency and mount in the payload; they count where they are larger than usual
    """
    largest = {name: max(stated[name]) for name in DESCRIBED if stated.get(name)}
    wider = {name: std for name, std in largest.items() if std > INITIAL_STD[name]}
    return INITIAL_STD | (MOVING_START_STD if moving else {}) | wider


class SlowStatePrior:
    """What is known of the slow states, carried from window to window.

    Each second is seen by several windows, so a share of what a window says is carried, and the
    mean follows by that share only: a prior re-centred on each window's estimate would let weakly
    observable directions walk.
    """

    def __init__(
        self,
        imu: Imu | None,
        *,
        has_motor: bool,
        moving: bool,
        frozen: Iterable[str],
        stated: Stated = MappingProxyType({}),
    ) -> None:
        std = initial_std(moving=moving, stated=stated) | dict.fromkeys(UNIT_STATES, 0.0)
        # A start in motion has no force at rest that a unit's errors could be told from, and until the
        # first windows have settled they would take up whatever is wrong.
        if imu is not None and not moving:
            std |= _with_unit(std, imu.errors_expected)
        frozen = {*frozen, *(name for name in UNIT_STATES if std[name] == 0.0)}
        names = _frozen_names(frozen, has_imu=imu is not None, has_motor=has_motor)
        self._information = np.zeros((N_STATES, N_STATES))
        self._offset = np.zeros(N_STATES)
        self._walk = np.zeros(N_STATES)
        walk = WALK if imu is None else WALK | {"gyro_bias": imu.gyro_walk_expected}
        self.frozen = places_of(names)
        for name, place in SLICES.items():
            index = np.arange(N_STATES)[place]
            # What is known exactly is frozen: any number keeps the matrix regular.
            self._information[index, index] = (std[name] or 1.0) ** -2
            self._walk[place] = walk.get(name, 0.0) ** 2

    @property
    def information(self) -> NDArray[np.float64]:
        """(57, 57) information about the prior's mean."""
        return self._information

    @property
    def offset(self) -> list[float]:
        """Correction (57,) that leads from the prior's mean to the current values."""
        return self._offset.tolist()

    def reset(self, name: str, std: float | NDArray[np.float64]) -> None:
        """Replace what is known of one state by independent standard deviations about its value.

        What is known of the other states stays what it is when nothing is known of this one.
        """
        index = np.arange(N_STATES)[SLICES[name]]
        others = np.setdiff1d(np.arange(N_STATES), index)
        covariance = np.linalg.inv(self._information)
        self._information[:] = 0.0
        rest = np.ix_(others, others)
        self._information[rest] = np.linalg.inv(covariance[rest])
        self._information[index, index] = np.asarray(std) ** -2.0
        self._offset[index] = 0.0

    def observe_rest(self, quat_xyzw: NDArray[np.float64], std: NDArray[np.float64]) -> None:
        """Take the current accelerometer bias and gravity to add up to the force at rest.

        At rest only their horizontal sum is known: a bias looks like a tilt. Along gravity its
        magnitude, which is not estimated, adds to the error.

        Parameters
        ----------
        quat_xyzw : (4,) attitude at rest
        std : (3,) m/s², of the mean force at rest
        """
        to_map = geometry.to_matrices(quat_xyzw[None])[0]
        rows = np.zeros((2, N_STATES))
        rows[:, SLICES["accel_bias"]] = to_map[:2]
        # Turning gravity about x moves its y component down, about y its x component up.
        rows[:, SLICES["gravity"]] = STANDARD_GRAVITY * np.array([[0.0, 1.0], [-1.0, 0.0]])
        sigma = max(MIN_REST_STD, float(np.linalg.norm(std)))
        before = self._information.copy()
        self._information += rows.T @ rows / sigma**2
        self._offset[:] = np.linalg.solve(self._information, before @ self._offset)

    def discounted(self, covariance: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the covariance (57, 57) after a window as it is if matches depend on each other."""
        active = ~self.frozen
        honest = np.zeros_like(covariance)
        if active.any():
            block = np.ix_(active, active)
            gained = self._gained(covariance, block)
            honest[block] = np.linalg.inv(self._information[block] + MATCH_INDEPENDENCE * gained)
        return honest

    def carry(
        self,
        covariance: NDArray[np.float64],
        offset: Sequence[float],
        shift: float,
        window: float,
    ) -> None:
        """Forget by the random walks over `shift` seconds, and add what a window has gained.

        Parameters
        ----------
        covariance : (57, 57) of the slow states after the window, prior included
        offset : (57,) correction that leads from the prior's mean to the window's estimate
        shift, window : s
        """
        active = ~self.frozen
        if not active.any():
            return
        block = np.ix_(active, active)
        before, gained = self._information[block], self._gained(covariance, block)
        diffused = np.linalg.inv(before) + np.diag(self._walk[active] * shift)
        share = MATCH_INDEPENDENCE * shift / window
        after = np.linalg.inv(diffused) + share * gained
        self._information[block] = 0.5 * (after + after.T)
        # The window alone says x_w, with gained (x_w - mean) = (before + gained) (estimate - mean).
        estimate = np.asarray(offset)[active]
        pull = share * (before + gained) @ estimate
        self._offset[active] = estimate - np.linalg.solve(after, pull)

    def _gained(
        self, covariance: NDArray[np.float64], block: tuple[NDArray[Any], ...]
    ) -> NDArray[np.float64]:
        """Information of a window without that of its prior."""
        return _positive_part(np.linalg.inv(covariance[block]) - self._information[block])


def _with_unit(std: Mapping[str, float], errors: Mapping[str, float]) -> dict[str, float]:
    """Return the standard deviations of the states that the errors of a unit add to.

    Biases are those under the force at the start, and the frame of the unit is that of its gyro.
    """
    force = STANDARD_GRAVITY * float(np.hypot(errors["accel_scale"], errors["accel_misalignment"]))
    added = {
        "accel_bias": force,
        "extrinsic_rotation": errors["gyro_misalignment"],
    }
    return {**errors, **{name: float(np.hypot(std[name], more)) for name, more in added.items()}}


def at_epoch(covariance: NDArray[np.float64], later: float) -> NDArray[np.float64]:
    """Return the covariance (57, 57) with the latency at an epoch so much later, s."""
    change = np.eye(N_STATES)
    change[SLICES["latency"], SLICES["latency_rate"]] = later
    return np.asarray(change @ covariance @ change.T)


def named_std(covariance: NDArray[np.float64], frozen: NDArray[np.bool_]) -> dict[str, list[float]]:
    """Return the standard deviations of the states that are estimated, by name."""
    std = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    for name in UNIT_STATES:
        std[SLICES[name]] *= REPEATED
    return {name: std[s].tolist() for name, s in SLICES.items() if not frozen[s].all()}


def places_of(names: Iterable[str]) -> NDArray[np.bool_]:
    """Return which entries (57,) are those of the states with these names."""
    chosen = np.zeros(N_STATES, dtype=bool)
    for name in names:
        chosen[SLICES[name]] = True
    return chosen


def _frozen_names(frozen: Iterable[str], *, has_imu: bool, has_motor: bool) -> set[str]:
    names = set(frozen)
    unknown = names - SLICES.keys()
    if unknown:
        msg = f"frozen: unknown states {sorted(unknown)}; choose from {list(SLICES)}"
        raise UsageError(msg)
    if "latency" in names:
        names.add("latency_rate")  # a latency that is known is known at all times
    if not has_imu:
        names |= SLICES.keys() - set(MOTOR_STATES)
    if not has_motor:
        names |= set(MOTOR_STATES)
    return names


def _positive_part(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """Drop directions of negative information, which only rounding makes."""
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T)
