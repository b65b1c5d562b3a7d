# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run localized in the map of another one, against the truth of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.simulated.truth import Truth, mapped_points
from bentwing.evaluate.trajectory import absolute_error

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.evaluate.alignment import Alignment


@dataclass(frozen=True, slots=True)
class LocalizedScore:
    """Errors of a localized run.

    Attributes
    ----------
    across, along : m, root mean square of the IMU's positions in flight, across its z axis and along it
    map_std : m, of the map's points from the true surfaces
    """

    across: float
    along: float
    map_std: float


def localized_score(localized: Path, recording: Path, site: Path, surveyed: Path) -> LocalizedScore:
    """Compare a localized run with its truth, in the frame of the site; nothing is aligned again.

    Parameters
    ----------
    localized, recording : the run, and its simulated recording
    site, surveyed : the run whose map was given, and its simulated recording
    """
    T, truth = _alignment(site, Truth(surveyed)), Truth(recording)
    found, _ = read_tum(localized / "trajectory.txt", truth.origin_ns)
    first, last = truth.flight
    times = found.times[(found.times >= first) & (found.times <= last)]
    positions, quats = truth.trajectory.interpolate(times)
    off = found.interpolate(times)[0] @ T.R.T + T.t - positions
    axis = geometry.rotate(quats, np.tile([0.0, 0.0, 1.0], (len(quats), 1)))
    along = (off * axis).sum(axis=1)
    across = np.linalg.norm(off - along[:, None] * axis, axis=1)
    points = mapped_points(localized / "map.laz", truth.origin_ns, truth.flight) @ T.R.T + T.t
    return LocalizedScore(_rms(across), _rms(along), surface_error(truth.distances(points)).std)


def _alignment(run: Path, truth: Truth) -> Alignment:
    """Where a run's frame is in that of its truth."""
    found, _ = read_tum(run / "trajectory.txt", truth.origin_ns)
    return absolute_error(found, truth.trajectory, during=truth.flight).alignment


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))
