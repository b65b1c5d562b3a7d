# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the continuous estimator is doing.

Waiting ─▶ Running ─▶ Waiting, behind a break that could not be bridged
            │  ▲
            ▼  │
      Stalled, Bridging
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from bentwing.base.breaks import Break
    from bentwing.odometry.continuous.odometry_pass import OdometryPass


@dataclass(frozen=True, slots=True)
class Waiting:
    """For enough data to find where a pass begins."""


@dataclass(frozen=True, slots=True)
class Running:
    """The window slides on."""

    under_way: OdometryPass


@dataclass(frozen=True, slots=True)
class Stalled:
    """The window slides on while the head of a 2D lidar stands still.

    Attributes
    ----------
    before : the pass as it was when the head came to stand
    since : s
    """

    under_way: OdometryPass
    before: OdometryPass
    since: float


@dataclass(frozen=True, slots=True)
class Bridging:
    """The window slides on behind a break, and it is not known yet whether it has found its place.

    Attributes
    ----------
    before : the pass as it was at the break
    """

    under_way: OdometryPass
    before: OdometryPass
    broken: Break


Begun: TypeAlias = Running | Stalled | Bridging
Phase: TypeAlias = Waiting | Begun
