# SPDX-License-Identifier: MIT OR Apache-2.0
"""When a sweep or scan is degenerate, and when that is worth a sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

# A sweep is degenerate when it says so much less, as a share of all, about its translation or its
# rotation in one direction: the surfaces it sees could be shifted or turned along themselves.
LEAST_SHARE = 5e-4
FEW = 0.02
"""More of the sweeps than this are worth a sentence."""


def is_degenerate(translation: Sequence[float], rotation: Sequence[float]) -> bool:
    """Whether shares of information (3,), increasing, leave a direction unseen."""
    return min(translation[0], rotation[0]) < LEAST_SHARE
