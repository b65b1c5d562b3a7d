# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the beams of a multi-beam lidar truly point to, by the surfaces that many of them see."""

from __future__ import annotations

from bentwing.closing.beams.find import find_beams
from bentwing.closing.beams.found import FoundBeams

__all__ = ["FoundBeams", "find_beams"]
