# SPDX-License-Identifier: MIT OR Apache-2.0
"""The poses that agree best with the links, and the links that are false."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.pose_graph.graph import PoseGraph


@dataclass(frozen=True, slots=True)
class RobustSettings:
    """How false links are told; their squared residuals are measured by the median of all doubtful ones.

    Attributes
    ----------
    kernel_width : medians at which the kernel has lost three quarters of its weight
    max_ratio : medians above which a link is false in the end, and beyond which links between
        neighbours of the same two nodes disagree; smaller where true links are rejected less often than
        false ones accepted. Where the believed links have no long tail, less is enough
    growth : factor by which the kernel narrows from step to step, above 1; nearer to 1 is slower
        and less easily misled
    """

    kernel_width: float = 3.0
    max_ratio: float = 25.0
    growth: float = 2.0

    def __post_init__(self) -> None:
        if not (self.kernel_width > 0 and self.max_ratio > 1 and self.growth > 1):
            msg = f"kernel_width must be above 0, max_ratio and growth above 1, got {self}"
            raise ValueError(msg)


@dataclass(frozen=True, slots=True)
class SolveSettings:
    """When the search ends, and whether links may be false.

    Attributes
    ----------
    max_iterations : of a minimization at most
    min_relative_decrease : share of the cost that another step must promise to take away
    robust : None believes every link
    """

    max_iterations: int = 100
    min_relative_decrease: float = 1e-6
    robust: RobustSettings | None = RobustSettings()

    def __post_init__(self) -> None:
        if self.max_iterations < 1 or not 0 <= self.min_relative_decrease < 1:
            msg = f"max_iterations must be at least 1, min_relative_decrease in [0, 1), got {self}"
            raise ValueError(msg)


@dataclass(frozen=True, slots=True)
class Solution:
    """The best poses of a graph.

    Attributes
    ----------
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, `R_map_node`
    weights : (L,) float64, of the links: 1 believed, 0 rejected
    chi2 : (L,) float64, squared residual `rᵀΩr` of each link, rejected or not
    cost : `½ Σ w rᵀΩr` over links and gravity
    initial_cost : the same at the given poses, with all links
    iterations : linearizations in all
    converged : whether the last step promised too little to go on
    """

    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]
    weights: NDArray[np.float64]
    chi2: NDArray[np.float64]
    cost: float
    initial_cost: float
    iterations: int
    converged: bool

    @property
    def rejected(self) -> NDArray[np.intp]:
        """Rows of the links that were found false."""
        return np.flatnonzero(self.weights == 0.0)


def solve_pose_graph(graph: PoseGraph, settings: SolveSettings | None = None) -> Solution:
    """Find the poses that agree best with the links, and the links that are false.

    The search begins at the given poses or at those of the chordal relaxation, whichever cost
    less, and takes Powell's dog-leg steps. Links that are not trusted may be rejected: first only those
    are tried that links nearby vouch for, then those that do not contradict what these have told.

    Parameters
    ----------
    graph : to solve
    settings : default: robust

    Raises
    ------
    ValueError
        If an index does not exist or a number is not finite.
    SingularSystemError
        If the links, without those that are rejected, do not determine all poses.
    DivergedError
        If the cost is not finite.

    References
    ----------
    Carlone et al. 2015, Initialization techniques for 3D SLAM; Yang et al. 2020, Graduated
    non-convexity for robust spatial perception; Mangelson et al. 2018, Pairwise consistent measurement
    set maximization; Nocedal and Wright 2006, section 4.1.
    """
    result = _core.solve_pose_graph(
        graph.positions,
        graph.quats_xyzw,
        graph.fixed,
        links=graph.links,
        gravity=graph.gravity,
        settings=settings or SolveSettings(),
    )
    return Solution(
        result.positions,
        result.quats_xyzw,
        result.weights,
        result.chi2,
        result.cost,
        result.initial_cost,
        result.n_iterations,
        result.converged,
    )
