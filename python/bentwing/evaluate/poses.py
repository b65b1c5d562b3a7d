# SPDX-License-Identifier: MIT OR Apache-2.0
"""Errors of poses of which the first is given: RTE and RRE (Tazir 2020, eqs. 8 and 9)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.evaluate.alignment import associate

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class PoseErrors:
    """Errors at the stamps of the truth when both trajectories begin with the same pose.

    Attributes
    ----------
    times : (N,) s
    rte : (N,) m, `‖t_GT - t_E‖`
    rre : (N,) rad, `‖log(R_Eᵀ R_GT)‖_F`, which is √2 times the angle
    """

    times: NDArray[np.float64]
    rte: NDArray[np.float64]
    rre: NDArray[np.float64]


def pose_errors(
    estimate: Trajectory, truth: Trajectory, *, during: tuple[float, float] | None = None
) -> PoseErrors:
    """Compare poses, given the first of them.

    An error of the first attitude turns the whole estimate, as it does in use; `absolute_error`
    aligns all poses instead.

    Parameters
    ----------
    estimate, truth : on the same clock
    during : s, part to compare; the first pose is the first of this part

    Raises
    ------
    InputError
        If they share fewer than three stamps.

    References
    ----------
    Tazir 2020, eqs. (8) and (9).
    """
    found, true = associate(estimate, truth, during)
    turn = geometry.multiply(true.quats_xyzw[0], geometry.inverse(found.quats_xyzw[0]))
    positions = geometry.rotate(turn, found.positions - found.positions[0]) + true.positions[0]
    quats = geometry.multiply(turn, found.quats_xyzw)
    angles = geometry.log(geometry.multiply(geometry.inverse(quats), true.quats_xyzw))
    return PoseErrors(
        true.times,
        np.linalg.norm(true.positions - positions, axis=1),
        np.sqrt(2.0) * np.linalg.norm(angles, axis=1),
    )
