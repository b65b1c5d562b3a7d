# SPDX-License-Identifier: MIT OR Apache-2.0
"""Errors of the motion between poses, as evo and as Tazir 2020 define them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.evaluate.statistics import Statistics
from bentwing.evaluate.trajectory import angles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory


@dataclass(frozen=True, slots=True)
class RelativeError:
    """Relative pose error over pieces of the way, one after the other.

    Attributes
    ----------
    delta : m, least length of a piece along the reference
    translation : m; None where the reference has no orientations
    rotation : rad, likewise
    distance : m, of the distances between the ends of a piece; needs no orientations
    """

    delta: float
    translation: Statistics | None
    rotation: Statistics | None
    distance: Statistics


def relative_pose_error(
    estimate: Trajectory,
    positions: NDArray[np.float64],
    quats_xyzw: NDArray[np.float64] | None,
    delta: float,
) -> RelativeError | None:
    """Relative pose error `(Q_i⁻¹ Q_j)⁻¹ (P_i⁻¹ P_j)`, Q of the reference, P of the estimate.

    It is what `evo_rpe --delta DELTA --delta_unit m --pairs_from_reference` finds. A constant
    turn of the body frame counts, unlike in `drift`.

    Parameters
    ----------
    estimate : N poses
    positions, quats_xyzw : (N, 3) m and (N, 4) or None, of the reference at the same times
    delta : m

    Returns
    -------
    None where the whole way is shorter.

    References
    ----------
    Sturm et al. 2012, eq. (1).
    """
    i, j = _pieces(positions, delta)
    if not len(i):
        return None
    ours = estimate.positions[j] - estimate.positions[i]
    theirs = positions[j] - positions[i]
    distance = np.abs(np.linalg.norm(ours, axis=1) - np.linalg.norm(theirs, axis=1))
    translation = rotation = None
    if quats_xyzw is not None:
        back, back_true = (geometry.inverse(q[i]) for q in (estimate.quats_xyzw, quats_xyzw))
        moved = geometry.rotate(back, ours) - geometry.rotate(back_true, theirs)
        turned = geometry.multiply(back, estimate.quats_xyzw[j])
        translation = Statistics.of(np.linalg.norm(moved, axis=1))
        rotation = Statistics.of(angles(geometry.multiply(back_true, quats_xyzw[j]), turned))
    return RelativeError(delta, translation, rotation, Statistics.of(distance))


def translational_error(
    true_positions: NDArray[np.float64], positions: NDArray[np.float64]
) -> NDArray[np.float64]:
    """RTE (N,) m: `‖t_GT - t_E‖₂` (Tazir 2020, eq. 8), both in the frame of the first pose."""
    errors: NDArray[np.float64] = np.linalg.norm(true_positions - positions, axis=1)
    return errors


def rotational_error(
    true_quats: NDArray[np.float64], quats: NDArray[np.float64]
) -> NDArray[np.float64]:
    """RRE (N,): `‖logm(R_Eᵀ R_GT)‖_F` (Tazir 2020, eq. 9), √2 times the angle in rad."""
    # the logarithm is the skew matrix of the rotation vector, which holds each component twice
    errors: NDArray[np.float64] = np.sqrt(2.0) * angles(quats, true_quats)
    return errors


def _pieces(
    positions: NDArray[np.float64], delta: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """First and last index of pieces of the way that are at least `delta` long."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(positions, axis=0), axis=1))])
    ends = [0]
    while (end := int(np.searchsorted(way, way[ends[-1]] + delta))) < len(way):
        ends.append(end)
    return np.array(ends[:-1], np.int64), np.array(ends[1:], np.int64)
