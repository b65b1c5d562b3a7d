# SPDX-License-Identifier: MIT OR Apache-2.0
"""Leave out returns from the carrier itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.recording.sections.self_hits import SelfHit


def outside_boxes(points: NDArray[np.float64], self_hits: Iterable[SelfHit]) -> NDArray[np.bool_]:
    """Return which points lie in none of the payload's self-hit boxes.

    Parameters
    ----------
    points : (N, 3) float64, m, lidar frame
    self_hits : boxes in the lidar frame; their faces belong to them

    Returns
    -------
    (N,) bool
    """
    outside = np.ones(len(points), dtype=np.bool_)
    for region in self_hits:
        inside = np.ones(len(points), dtype=np.bool_)
        for along, low, high in zip(points.T, region.box.min, region.box.max, strict=True):
            inside &= (along >= low) & (along <= high)
        outside &= ~inside
    return outside
