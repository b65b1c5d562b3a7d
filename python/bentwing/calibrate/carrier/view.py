# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a lidar sees within a second: how far it looks in each direction, and what is near."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.mount import MotorMount
from bentwing.base.voxels import voxel_keys

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.mount import Mount
    from bentwing.recording.batches import LidarBatch

    Array = NDArray[np.float64]
    Keys = NDArray[np.int64]

NEAR = 2.0  # m; what is farther is not looked at as the carrier
EDGE = 0.1  # m, of a cell
STEP = np.radians(2.0)  # between directions
# Points of a view that are looked at: a share of all for the directions, and of the near ones.
N_DIRECTIONS, N_NEAR = 15_000, 20_000
# A range of another surface: by more than the noise, and than the slant within a direction.
OTHER, OTHER_SHARE = 0.1, 0.05


@dataclass(frozen=True, slots=True, eq=False)
class View:
    """A second of points, in the frame in which the carrier stands.

    That is the motor's frame where an encoder tells the lidar's turn, else the lidar's own.

    Attributes
    ----------
    directions, reaches : (D,) keys of directions, increasing, and the farthest range in each, m
    cells, towards : (M,) keys of the cells of near points, and of the directions in which they are
    points : (M, 3) float32, m, the near points in the lidar frame
    """

    directions: Keys
    reaches: Array
    cells: Keys
    towards: Keys
    points: NDArray[np.float32]

    @classmethod
    def of(cls, batches: Sequence[LidarBatch], mount: Mount) -> View:
        """Return the view of consecutive batches."""
        points = np.concatenate([batch.points for batch in batches])
        ranges = np.sqrt(np.einsum("ij,ij->i", points, points))
        angles = None
        if isinstance(mount, MotorMount):
            angles = np.concatenate([batch.angles for batch in batches if batch.angles is not None])
        chosen = slice(None, None, max(1, len(points) // N_DIRECTIONS))
        seen = _standing(points[chosen], angles, chosen, mount)
        directions, reaches = _farthest(direction_keys(seen), ranges[chosen])
        near = np.flatnonzero(ranges < NEAR)
        near = near[:: max(1, len(near) // N_NEAR)]
        there = _standing(points[near], angles, near, mount)
        cells, towards = voxel_keys(there, EDGE), direction_keys(there)
        return cls(directions, reaches, cells, towards, points[near].astype(np.float32))

    def differs_from(self, other: View) -> float:
        """Return the share of directions, of those seen in both, in which another surface is seen."""
        _, mine, others = np.intersect1d(
            self.directions, other.directions, assume_unique=True, return_indices=True
        )
        if not len(mine):
            return 0.0
        one, two = self.reaches[mine], other.reaches[others]
        return float(np.mean(np.abs(one - two) > OTHER + OTHER_SHARE * np.minimum(one, two)))

    def sees_along(self, directions: Keys) -> NDArray[np.bool_]:
        """Tell in which directions (N,) something was seen, at whatever range."""
        at = np.minimum(np.searchsorted(self.directions, directions), len(self.directions) - 1)
        return np.asarray(self.directions[at] == directions)


def direction_keys(points: Array) -> Keys:
    """Return keys (N,) of the directions of points (N, 3), of equal size all over the sphere."""
    ranges = np.linalg.norm(points, axis=1, keepdims=True)
    return voxel_keys(points / np.maximum(ranges, 1e-9), STEP)


def _standing(
    points: Array,
    angles: Array | None,
    chosen: slice | NDArray[np.intp],
    mount: Mount,
) -> Array:
    """Turn points of the lidar frame to axes that stand on the carrier; the origin stays the lidar."""
    if angles is None or not isinstance(mount, MotorMount):
        return points
    # Rodrigues' formula: quaternions of so many turns take three times as long.
    turns, there = (angles[chosen] + mount.encoder_zero)[:, None], points @ mount.T_motor_lidar.R.T
    along = (there @ mount.axis)[:, None] * mount.axis
    across = there @ np.cross(mount.axis, np.eye(3))
    return np.asarray(along + np.cos(turns) * (there - along) + np.sin(turns) * across)


def _farthest(keys: Keys, ranges: Array) -> tuple[Keys, Array]:
    order = np.argsort(keys, kind="stable")
    unique, first = np.unique(keys[order], return_index=True)
    return unique, np.maximum.reduceat(ranges[order], first) if len(first) else np.zeros(0)
