# SPDX-License-Identifier: MIT OR Apache-2.0
"""Rotations that cover all there are, evenly."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

# Every rotation is within 45° of one of the 60 that leave an icosahedron as it is.
COVERED = np.radians(45.0)


def cover(centre: Rotation, *, nearest_first: bool = True) -> list[Rotation]:
    """Return 60 rotations, `centre` among them, no rotation farther than `COVERED` from all of them.

    Parameters
    ----------
    nearest_first : order them by their angle to `centre`
    """
    around = Rotation.create_group("I")
    turned = [centre * Rotation.from_quat(quat) for quat in around.as_quat()]
    if nearest_first:
        turned.sort(key=lambda rotation: float((centre.inv() * rotation).magnitude()))
    return turned
