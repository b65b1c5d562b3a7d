# SPDX-License-Identifier: MIT OR Apache-2.0
"""The drives that are compared: with and without control, with both arms and both vanes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bentwing.flight.control.spin_controller import SpinSettings
from bentwing.simulate.plant.flights import Drive
from bentwing.simulate.plant.parameters import SINGLE_FLAP, PlantSettings

FREE_RATE = 2 * np.pi * 2.5
"""rad/s, free spinning at 2 to 3 Hz needs no control (Kaul 2015, section 5)."""
_NO_STALL_ANGLE = 1e-12  # rad

WITHOUT_STALL_PREVENTION = replace(SpinSettings(), stall_angle=_NO_STALL_ANGLE)
STRAIGHT = PlantSettings(arm_separation=np.pi)
FLAPS = PlantSettings(vanes=SINGLE_FLAP)


def held(rate: float) -> Drive:
    """Vanes fixed at the angle that gives `rate` (rad/s) in calm air."""
    return Drive(None, SpinSettings().map_gain * rate)


def drives(desired: float) -> dict[str, Drive]:
    """Return the drives that are compared at a desired rate (rad/s), by what the tables call them."""
    return {
        "135° arms, controller": Drive(),
        "135° arms, no stall prevention": Drive(WITHOUT_STALL_PREVENTION),
        "135° arms, no control": held(desired),
        "135° arms, single flaps, controller": Drive(plant=FLAPS),
        "180° arms, controller": Drive(plant=STRAIGHT),
        "180° arms, no control": replace(held(desired), plant=STRAIGHT),
        "135° arms, free at 2.5 Hz": held(FREE_RATE),
    }
