# SPDX-License-Identifier: MIT OR Apache-2.0
"""2D lidars, whose scans are single planes that cannot be registered by themselves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import NotEnoughDataError, PayloadError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording import Payload

PLANAR_KINDS = ("hokuyo-utm30lx",)
# Of a scan's extents in the lidar frame; a plane has none in one direction.
FLAT = 1e-4


def refuse_planar_kind(payload: Payload, method: str) -> None:
    """Refuse a payload that describes a 2D lidar.

    Raises
    ------
    PayloadError
    """
    kind = payload.lidar.kind
    if kind in PLANAR_KINDS:
        msg = (
            f"lidar.kind: {kind} is a 2D lidar, whose scans are single planes that {method} cannot "
            "register; use --estimator continuous"
        )
        raise PayloadError(msg)


def refuse_plane(points: NDArray[np.float64], method: str) -> None:
    """Refuse the first scan (N, 3), m, lidar frame, of a 2D lidar.

    Raises
    ------
    NotEnoughDataError
        If all points lie in one plane of the lidar frame, as those of a 2D scanner.
    """
    if is_plane(points):
        msg = (
            f"the {len(points)} points of the first scan lie in one plane, those of a 2D lidar: "
            f"{method} cannot register single planes, use --estimator continuous"
        )
        raise NotEnoughDataError(msg)


def is_plane(points: NDArray[np.float64]) -> bool:
    """Whether points (N, 3), m, lidar frame, lie in one plane, as those of a 2D lidar."""
    if len(points) < 3:
        return False
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(extents[2] < FLAT * extents[0])
