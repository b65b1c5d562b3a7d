# SPDX-License-Identifier: MIT OR Apache-2.0
"""Registers a scan to the keyframes, from where the motion of the last scans leads."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from bentwing import _core
from bentwing.base.errors import EstimationError
from bentwing.odometry.core_states import core_pose
from bentwing.odometry.ndt.motion import Placed

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.odometry.ndt.motion import Track, Twist
    from bentwing.odometry.ndt.scans import Scan

T = TypeVar("T")

# One point of each voxel of this edge is registered, m.
SPACING = 0.3
# How well the motion of the last scans predicts the next: rad and m, a carrier's accelerations over
# the tenth of a second of a scan.
ROTATION_SIGMA, TRANSLATION_SIGMA = 0.02, 0.1
# Errors of a scan (its distortion, the voxels') are common to its points; about one in a hundred
# counts as independent.
INDEPENDENCE = 0.01
# A scan with fewer inliers among its matches, or matches among its points, has not found its place.
LEAST_INLIERS, LEAST_MATCHES = 0.2, 0.2


@dataclass(frozen=True, slots=True)
class Match:
    """A scan in its place.

    Attributes
    ----------
    pose : of the IMU at the scan's time
    points : (N, 3) float64, m, all points in the IMU frame at that time
    n_points : number of those that were registered
    registration : what is known of it
    """

    pose: Placed
    points: NDArray[np.float64]
    n_points: int
    registration: _core.NdtRegistration


class Matcher:
    """Registers scans of one head.

    Parameters
    ----------
    head : how the lidar is mounted
    max_points : of a scan that are registered
    threads : 0 is one per core
    """

    def __init__(self, head: _core.Globals, max_points: int, threads: int) -> None:
        self._head = head
        self._max_points = max_points
        self._threads = threads
        self.timings = {"place": 0.0, "register": 0.0}

    def placed(self, scan: Scan, twist: Twist) -> NDArray[np.float64]:
        """All points of a scan in the IMU frame at its time, if the twist holds all along."""
        return self._timed("place", lambda: scan.placed(twist, self._head, self._threads))

    def match(self, scan: Scan, track: Track, reference: _core.NdtReference) -> Match | None:
        """Find the place of a scan near where the track leads; None if it fits nowhere there."""
        points = self.placed(scan, track.twist())
        chosen = _core.thin_points(points, spacing=SPACING, most=self._max_points)
        try:
            first = self._fit(reference, points[chosen], track.expected(scan.time), coarse=True)
            # Once more without the distortion by what of the motion was not expected.
            pose = _pose(scan, first)
            points = self.placed(scan, track.twist_at(pose))
            found = self._fit(reference, points[chosen], pose, coarse=False)
        except EstimationError:
            return None
        n_points = len(chosen)
        if found.inlier_share < LEAST_INLIERS or found.n_matched < LEAST_MATCHES * n_points:
            return None
        return Match(_pose(scan, found), points, n_points, found)

    def _fit(
        self,
        reference: _core.NdtReference,
        points: NDArray[np.float64],
        expected: Placed,
        *,
        coarse: bool,
    ) -> _core.NdtRegistration:
        return self._timed(
            "register",
            lambda: reference.register(
                points,
                core_pose(expected),
                rotation_sigma=ROTATION_SIGMA,
                translation_sigma=TRANSLATION_SIGMA,
                independence=INDEPENDENCE,
                coarse=coarse,
                threads=self._threads,
            ),
        )

    def _timed(self, name: str, work: Callable[[], T]) -> T:
        began = time.perf_counter()
        try:
            return work()
        finally:
            self.timings[name] += time.perf_counter() - began


def _pose(scan: Scan, found: _core.NdtRegistration) -> Placed:
    return Placed(found.translation, found.quat_xyzw, scan.time)
