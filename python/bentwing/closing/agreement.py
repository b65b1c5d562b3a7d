# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which matches of the places of two runs agree on where the one lies in the other.

References
----------
Mangelson et al. 2018, Pairwise consistent measurement set maximization for robust multi-robot map
merging.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

# Two matches contradict each other if they put one of their places farther apart than this, m: where
# surfaces are seen from two sides or through leaves an alignment is wrong by decimetres.
_APART = 0.4
# And in proportion to the time between them, m/s, in which each run may have drifted: 5 mm in a metre, the
# most that Kaul 2015 (figure 24) saw, at 1 m/s. More would let a row of equal pillars agree with the next.
_DRIFT = 0.005
# Both maps are level and only the heading is free: a false match is off by any angle, a true one by little.
_TURNED = np.radians(2.0)
_TURN_DRIFT = np.radians(0.02)


@dataclass(frozen=True, slots=True)
class Sighting:
    """What a match of two places says about where run b lies in run a.

    Attributes
    ----------
    T_a_b : (4, 4)
    centre : (3,) m, of the place, in the map of b
    time_a, time_b : s, when each run was there; a map that does not drift has one time for all
    """

    T_a_b: NDArray[np.float64]
    centre: NDArray[np.float64]
    time_a: float
    time_b: float


@dataclass(frozen=True, slots=True)
class Group:
    """The largest group of sightings in which all agree.

    Attributes
    ----------
    agree : (M, M) bool, whether two sightings may both be true
    members : (M,) bool
    contested : whether others that agree with no member are a group as large: nothing tells then
        which one is right
    """

    agree: NDArray[np.bool_]
    members: NDArray[np.bool_]
    contested: bool


def largest_group(sightings: Sequence[Sighting]) -> Group:
    """Find the largest group of one or more sightings, and whether another contests it."""
    agree = agreements(sightings)
    members = _grown(agree)
    # what agrees with some members but not with all has drifted; it speaks against none
    rivals = np.flatnonzero(~agree[members].any(axis=0))
    contested = len(rivals) > 0 and _grown(agree[np.ix_(rivals, rivals)]).sum() >= members.sum()
    return Group(agree, members, bool(contested))


def agreements(sightings: Sequence[Sighting]) -> NDArray[np.bool_]:
    """Compare sightings by where each puts the place of the other: (M, M), symmetric."""
    T = np.stack([s.T_a_b for s in sightings])
    R, t = T[:, :3, :3], T[:, :3, 3]
    # [p, q] is where p puts the place of q
    put = np.einsum("pij,qj->pqi", R, [s.centre for s in sightings]) + t[:, None]
    shifts = np.linalg.norm(put - np.einsum("qqi->qi", put), axis=2)
    cosines = 0.5 * (np.einsum("pij,qij->pq", R, R) - 1.0)
    turns = np.arccos(np.clip(cosines, -1.0, 1.0))
    elapsed = sum(
        np.abs(np.subtract.outer(times, times))
        for times in ([s.time_a for s in sightings], [s.time_b for s in sightings])
    )
    near = np.minimum(shifts, shifts.T) <= _APART + _DRIFT * elapsed
    agree: NDArray[np.bool_] = near & (turns <= _TURNED + _TURN_DRIFT * elapsed)
    return agree


def _grown(agree: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Members (M,) of a large group in which all agree, grown from the best supported one."""
    members = np.zeros(len(agree), dtype=np.bool_)
    candidates = np.ones(len(agree), dtype=np.bool_)
    while candidates.any():
        support = (agree & candidates).sum(axis=1)
        best = int(np.argmax(np.where(candidates, support, -1)))
        members[best] = True
        candidates &= agree[best]
        candidates[best] = False
    return members
