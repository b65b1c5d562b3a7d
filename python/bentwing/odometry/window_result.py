# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the registration of one window returns, and how later windows use it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base.value import Value

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.calibration import Calibration
    from bentwing.base.trajectory import Trajectory


@dataclass(frozen=True, slots=True, eq=False)
class FixedView:
    """Surfaces that a window has seen in `[start, stop)`, s, which do not move any more."""

    start: float
    stop: float
    _surfels: _core.Surfels = field(repr=False)
    _samples: _core.Samples = field(repr=False)
    _globals: _core.Globals = field(repr=False)

    def in_core(self) -> _core.FixedView:
        """Return the view as the core takes it, with its search grids: milliseconds of work."""
        return _core.FixedView([self._surfels], self.start, self.stop, self._samples, self._globals)


@dataclass(frozen=True, slots=True, eq=False)
class WindowSurfels(Value):
    """Pieces of surface that a window has seen.

    Attributes
    ----------
    points : (S, 3) float64, m, their middles in the map
    normals : (S, 3) float64, unit, towards the lidar
    times : (S,) float64, s, non-decreasing, mean of their points', lidar clock
    edges : (S,) float64, m, of the voxels that their points were in
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    times: NDArray[np.float64]
    edges: NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class WindowResult(Value):
    """The corrected trajectory of a window, and how well the points determine it.

    Attributes
    ----------
    trajectory : the prior's poses, corrected
    calibration : the slow states with their standard deviations; gravity as in the prior's map
    n_surfels : pieces of surface found in the points
    n_matches, n_fixed_matches : pairs of them within the window, and with the fixed views
    inlier_share : share of the matches that agree within two standard deviations
    residual_rms : of the matches, in units of the expected noise
    translation_eigenvalues, rotation_eigenvalues : (3,) how well the matches see translation and
        rotation, increasing; 1/3 each is even, near zero is not seen
    iterations : how often the surfaces were matched anew
    converged : whether the last correction was below the thresholds
    covariances : (N, 6, 6) of the correction [rotation, translation] at each prior pose, rad and m,
        perturbed on the left in the map frame; from the last linearized equations as if all matches
        were independent, so that their ratios say more than their size; zero where the past stays
    """

    trajectory: Trajectory
    calibration: Calibration
    n_surfels: int
    n_matches: int
    n_fixed_matches: int
    inlier_share: float
    residual_rms: float
    translation_eigenvalues: NDArray[np.float64]
    rotation_eigenvalues: NDArray[np.float64]
    iterations: int
    converged: bool
    covariances: NDArray[np.float64]
    _surfels: _core.Surfels = field(repr=False, compare=False)
    _samples: _core.Samples = field(repr=False, compare=False)
    _globals: _core.Globals = field(repr=False, compare=False)

    @property
    def surfels(self) -> WindowSurfels:
        """The pieces of surface in the points, where the corrected trajectory puts them."""
        own = self._surfels
        order = np.argsort(own.stamps, kind="stable")
        means, stamps, angles = own.means[order], own.stamps[order], own.angles[order]
        ends = [
            self._samples.place_shots(places, stamps, angles, self._globals)[0]
            for places in (means, means + own.normals[order])
        ]
        return WindowSurfels(ends[0], ends[1] - ends[0], stamps, own.voxel_sizes[order])

    def fixed_view(self, start: float | None = None, stop: float | None = None) -> FixedView:
        """Freeze the surfels of `[start, stop)`, s, in the map, for later windows to match with.

        Raises
        ------
        ValueError
            If `start` is not before `stop`.
        """
        start = float(self.trajectory.times[0]) if start is None else start
        stop = float(self.trajectory.times[-1]) if stop is None else stop
        if not start < stop:
            msg = f"start: expected a time before stop, got {start} and {stop} s"
            raise ValueError(msg)
        return FixedView(start, stop, self._surfels, self._samples, self._globals)
