# SPDX-License-Identifier: MIT OR Apache-2.0
"""A scenario ready to be recorded: a world, a rig in motion, and its sensors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.simulate.realism.draw import Realism
    from bentwing.simulate.rig import Rig
    from bentwing.simulate.scenes import World
    from bentwing.simulate.stream import Sensors


@dataclass(frozen=True, slots=True)
class Setup:
    """A scenario ready to be recorded.

    Attributes
    ----------
    first, last : s, what of the rig's motion is recorded
    realism : what was drawn of real sensors' errors
    """

    world: World
    rig: Rig
    sensors: Sensors
    first: float
    last: float
    realism: Realism
