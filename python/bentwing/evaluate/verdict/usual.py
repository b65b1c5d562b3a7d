# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is usual in a good result of each estimator, told by its records."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.window_record import WindowRecord


@dataclass(frozen=True, slots=True)
class Usual:
    """What good poses are off, and how many of their matches.

    Attributes
    ----------
    outliers : share of the matches, in a stretch of some seconds
    rate, force : rad/s and m/s², between trajectory and IMU over a step of half a second
    drift : m a metre, open-loop
    bridges : whether inertial samples at the end of their range are bridged
    """

    outliers: float
    rate: float
    force: float
    drift: float
    bridges: bool = False


# Half a milliradian and some millimetres at both ends of a step; a sweep or a scan says less than a
# window of several seconds, and the poses of scans know nothing of the IMU.
_WINDOWS = Usual(outliers=0.01, rate=1e-3, force=0.05, drift=0.002, bridges=True)
_SWEEPS = Usual(outliers=0.04, rate=2e-3, force=0.15, drift=0.01)
_SCANS = Usual(outliers=0.08, rate=6e-3, force=0.3, drift=0.015)


def usual_of(windows: Sequence[WindowRecord]) -> Usual:
    """Return what is usual of windows, of sweeps of the filter or of scans of NDT odometry."""
    if not windows or windows[0].registered is None:
        return _WINDOWS
    return _SCANS if windows[0].n_planar is None else _SWEEPS
