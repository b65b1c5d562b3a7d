# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where the beams of a multi-beam lidar truly point to, by the surfaces that many of them see."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.beams.find import find_beams
    from bentwing.closing.beams.found import FoundBeams
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "closing.beams.find": ["find_beams"],
            "closing.beams.found": ["FoundBeams"],
        },
    )

__all__ = ["FoundBeams", "find_beams"]
