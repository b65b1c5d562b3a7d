# SPDX-License-Identifier: MIT OR Apache-2.0
"""What NDT odometry is doing.

Waiting ─▶ Opening ─▶ Following ─▶ Opening, where the place was lost
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from bentwing.odometry.ndt.motion import Track
    from bentwing.odometry.ndt.scans import Scan


@dataclass(frozen=True, slots=True)
class Waiting:
    """For a scan to begin with."""


@dataclass(frozen=True, slots=True)
class Opening:
    """The first scan of a track is the keyframe, bent by a motion that the next scan will tell."""

    track: Track
    scan: Scan


@dataclass(frozen=True, slots=True)
class Following:
    """Scans are registered to the keyframes."""

    track: Track


Begun: TypeAlias = Opening | Following
Phase: TypeAlias = Waiting | Begun
