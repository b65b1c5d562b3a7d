# SPDX-License-Identifier: MIT OR Apache-2.0
"""Vane angle from the measured and the desired rate of a head that the downdraft spins.

Three terms are summed and limited (Kaul 2015, section 3.2.3, Fig. 10): a map from the desired rate
(what holds it in calm hover), a part of the error, and a large fixed angle while the head is about
to stall.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.flight.control.checks import age_fault, fault, require_positive

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


@dataclass(frozen=True, slots=True)
class SpinSettings:
    """The law of Fig. 10; angles in rad, rates in rad/s, gains in rad per rad/s.

    The gains are those of the simulated plant in `bentwing.simulate.plant`, found as the paper
    says: the map in calm hover, then the proportional gain in gusts, up to where it oscillates.

    Attributes
    ----------
    map_gain : k_m; set it in calm hover until the rate follows without the other terms
    proportional_gain : k_p; larger holds the rate tighter until it oscillates
    stall_angle : k_sp, added below `stall_rate`
    stall_rate : below it the head is about to stall
    lowest_desired, highest_desired : what may be commanded; other wishes are limited to it
    lowest_angle, highest_angle : what the servos and vanes can do
    max_age : s, older measurements are not used
    max_rate : a larger measured rate is an error of the sensor
    """

    map_gain: float = 0.0505
    proportional_gain: float = 0.3
    stall_angle: float = math.radians(45.0)
    stall_rate: float = math.radians(180.0)
    lowest_desired: float = math.radians(180.0)
    highest_desired: float = math.radians(540.0)
    lowest_angle: float = math.radians(-20.0)
    highest_angle: float = math.radians(60.0)
    max_age: float = 0.3
    max_rate: float = math.radians(3600.0)

    def __post_init__(self) -> None:
        names = (
            "map_gain", "proportional_gain", "stall_angle", "stall_rate", "lowest_desired",
            "highest_desired", "highest_angle", "max_age", "max_rate",
        )  # fmt: skip
        require_positive({name: getattr(self, name) for name in names})
        if not self.lowest_desired < self.highest_desired <= self.max_rate:
            msg = f"lowest_desired, highest_desired, max_rate: expected in rising order, got {self}"
            raise UsageError(msg)
        if not self.lowest_angle < self.highest_angle <= math.pi / 2:
            msg = f"lowest_angle, highest_angle: expected in rising order up to π/2, got {self}"
            raise UsageError(msg)


@dataclass(frozen=True, slots=True)
class SpinTerms:
    """What the three terms ask for, rad, and their limited sum `angle`."""

    map: NDArray[np.float64]
    proportional: NDArray[np.float64]
    stall: NDArray[np.float64]
    angle: NDArray[np.float64]


def spin_terms(settings: SpinSettings, measured: ArrayLike, desired: ArrayLike) -> SpinTerms:
    """Return the three terms of Fig. 10 for checked rates of any shape, rad/s."""
    rate, wish = np.asarray(measured, np.float64), limited(settings, desired)
    mapped = settings.map_gain * wish
    proportional = settings.proportional_gain * (wish - rate)
    stall = np.where(rate < settings.stall_rate, settings.stall_angle, 0.0)
    angle = np.clip(mapped + proportional + stall, settings.lowest_angle, settings.highest_angle)
    return SpinTerms(mapped, proportional, stall, angle)


def limited(settings: SpinSettings, desired: ArrayLike) -> NDArray[np.float64]:
    """Limit desired rates to what may be commanded."""
    wish: NDArray[np.float64] = np.clip(
        np.asarray(desired, np.float64), settings.lowest_desired, settings.highest_desired
    )
    return wish


@dataclass(frozen=True, slots=True)
class SpinCommand:
    """Where to set the vanes.

    Attributes
    ----------
    angle : rad, of the vanes against the downdraft
    map, proportional, stall : rad, the terms before the limit
    is_preventing_stall : whether the head is about to stall
    faults : what of the input could not be used, and what was done instead; empty in good order
    """

    angle: float
    map: float
    proportional: float
    stall: float
    is_preventing_stall: bool
    faults: tuple[str, ...] = ()


class SpinController:
    """Holds the rate of a passively spun head; remembers nothing between calls.

    A measurement that is not finite, stale, from the future or beyond what a head can turn is not
    used: the map alone sets the vanes then, which holds the rate in calm air, and `faults` says so.

    Examples
    --------
    >>> controller = SpinController()
    >>> command = controller.command(12.00, 4.1, measured_at=11.98, desired=4.7)
    >>> command.faults
    ()
    """

    def __init__(self, settings: SpinSettings | None = None) -> None:
        self.settings = settings or SpinSettings()

    def command(
        self, time: float, measured: float, *, measured_at: float, desired: float
    ) -> SpinCommand:
        """Return the vane angle.

        Parameters
        ----------
        time : s, now
        measured : rad/s, gyro about the spin axis, positive the way the vanes drive
        measured_at : s, when that was, same clock
        desired : rad/s, limited to what may be commanded; if it is not finite, the lowest is taken
        """
        settings, faults = self.settings, []
        if not math.isfinite(desired):
            faults.append(f"desired rate is {desired}: the lowest is held")
            desired = settings.lowest_desired
        found = fault("measured rate", measured, settings.max_rate)
        found = found or age_fault("measured rate", time - measured_at, settings.max_age)
        if found is not None:
            faults.append(f"{found}: the map alone sets the vanes")
            measured = max(float(limited(settings, desired)), settings.stall_rate)
        terms = spin_terms(settings, measured, desired)
        return SpinCommand(
            float(terms.angle),
            float(terms.map),
            float(terms.proportional),
            float(terms.stall),
            bool(terms.stall > 0),
            tuple(faults),
        )
