# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the Kalman filter is doing.

Waiting ─▶ Rehearsing ─▶ Running ─▶ Waiting, behind a break
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from bentwing.odometry.kalman.filter_pass import FilterPass


@dataclass(frozen=True, slots=True)
class Waiting:
    """For enough inertial samples to find where a pass begins.

    Attributes
    ----------
    rehearses : whether the pass will be a rehearsal
    """

    rehearses: bool


@dataclass(frozen=True, slots=True)
class Rehearsing:
    """The filter learns mounts and delays, to begin again with them."""

    under_way: FilterPass


@dataclass(frozen=True, slots=True)
class Running:
    """The filter follows the carrier."""

    under_way: FilterPass


Begun: TypeAlias = Rehearsing | Running
Phase: TypeAlias = Waiting | Begun
