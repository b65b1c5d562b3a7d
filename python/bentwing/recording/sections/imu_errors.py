# SPDX-License-Identifier: MIT OR Apache-2.0
"""How large the errors of an inertial unit are, by its kind or by own figures."""

from __future__ import annotations

from types import MappingProxyType
from typing import Annotated, Literal

from bentwing.base.units import Unit
from bentwing.recording.sections.section import NonNegative, Section

ImuKind = Literal["consumer", "industrial", "tactical"]


class ImuErrors(Section):
    """Standard deviations of what a unit does wrong beside its biases; 0 for what it does right.

    Attributes
    ----------
    gyro_scale, accel_scale : shares of rates and forces
    gyro_misalignment, accel_misalignment : rad, by which an axis leans to another
    g_sensitivity : rad/s per m/s², rates that forces feign
    """

    gyro_scale: NonNegative | None = None
    gyro_misalignment: Annotated[NonNegative | None, Unit("rad")] = None
    g_sensitivity: Annotated[NonNegative | None, Unit("rad/s per m/s²")] = None
    accel_scale: NonNegative | None = None
    accel_misalignment: Annotated[NonNegative | None, Unit("rad")] = None


def _of_size(size: float, g_sensitivity: float) -> dict[str, float]:
    return {
        "gyro_scale": size,
        "gyro_misalignment": size,
        "g_sensitivity": g_sensitivity,
        "accel_scale": size,
        "accel_misalignment": size,
    }


# Data sheets: 1 % and 0.1 °/s/g of a phone's or a drone's unit, 0.3 % and 0.02 °/s/g of one that is
# calibrated as a series, 0.05 % and 0.002 °/s/g of one that is calibrated itself.
USUAL = MappingProxyType({
    "consumer": _of_size(0.01, 2e-4),
    "industrial": _of_size(3e-3, 4e-5),
    "tactical": _of_size(5e-4, 4e-6),
})  # fmt: skip

# A gyro's bias walks at least so fast, rad/s²/√Hz: 10, 5 and 0 mdps/°C while a unit warms up by 20 °C in
# ten minutes are a ramp that a walk must follow over some tens of seconds.
WARMING = MappingProxyType({"consumer": 4e-5, "industrial": 2e-5, "tactical": 0.0})


def expected_errors(kind: ImuKind, own: ImuErrors) -> dict[str, float]:
    """Return the standard deviations by name: own figures, else those of the kind."""
    given = {name: value for name, value in own if value is not None}
    return {**USUAL[kind], **given}
