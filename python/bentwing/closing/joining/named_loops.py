# SPDX-License-Identifier: MIT OR Apache-2.0
"""The loops a user has named, judged by what was seen, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.transform import from_poses, inverse, rigid
from bentwing.closing.joining.matches import Match, Part
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.places import Alignment, Candidate, MatchSettings, match_pair, verified

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.loop_file import NamedLoop
    from bentwing.closing.places import Agreement, Place

    Matrix = NDArray[np.float64]

# A transform that a user has measured, as good as one can by eye, m and rad.
_BY_EYE = (0.1, np.radians(2.0))
# What is seen may correct such a transform by so much, m and rad.
_CORRECTED = (1.0, np.radians(10.0))
# Rooms built alike are told apart by the little that stands elsewhere in them; whoever names two times knows
# which room it was, and that something may have been moved in between.
_SAID_SAME = MatchSettings(max_conflict=MatchSettings().max_leafy_conflict)
# Beyond this, m, the finished trajectory does not keep to a loop.
_KEPT = 0.3
_SAID_APART = "named as not the same place"


@dataclass(frozen=True, slots=True)
class Named:
    """A loop, and what was seen at its times.

    Attributes
    ----------
    loop : as the user gave it
    match : of the places of its times; None where there are none
    at : s, where along the two places the link holds best: in their middles, or at the times of a
        transform that is taken as given
    said : whether it is used and why, in a sentence
    """

    loop: NamedLoop
    match: Match | None
    at: tuple[float, float]
    said: str

    @property
    def is_used(self) -> bool:
        """Whether the loop links two places."""
        return self.loop.same and self.match is not None and self.match.believed


def judge_loops(
    loops: Sequence[NamedLoop],
    trajectories: Mapping[Part, Trajectory],
    places: Mapping[Part, Sequence[Place]],
) -> list[Named]:
    """Find the places that loops speak of, and say which of these agree with what is seen."""
    return [_judged(loop, trajectories, places) for loop in loops]


def without_denied(matches: Sequence[Match], named: Sequence[Named]) -> list[Match]:
    """Reject the matches of places that a user has named as not the same."""
    denied = {
        frozenset((id(n.match.place_a), id(n.match.place_b)))
        for n in named
        if n.match is not None and not n.loop.same
    }
    return [
        m.rejected(_SAID_APART) if frozenset((id(m.place_a), id(m.place_b))) in denied else m
        for m in matches
    ]


def outcomes(
    named: Sequence[Named],
    before: Mapping[Part, Trajectory],
    after: Mapping[Part, Trajectory],
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return what became of loops for run.json, and warnings about those that did not hold.

    Parameters
    ----------
    before, after : trajectories of the parts without and with the loops
    """
    told, warnings = [], []
    for one in named:
        said, off = one.said, None
        if one.is_used and one.match is not None:
            off = [_off(one.match, one.at, poses, before) for poses in (before, after)]
            if off[1] > _KEPT:
                said = (
                    f"what else is seen contradicts it: the trajectory leaves it by {off[1]:.2f} m"
                )
        is_kept = said == one.said and (one.is_used or not (one.loop.same or one.match is None))
        told.append({**one.loop.model_dump(mode="json"), "kept": is_kept, "said": said, "off": off})
        if not is_kept:
            warnings.append(f"the loop of {one.loop}: {said}; look at both times, or take it out")
    return told, warnings


def _judged(
    loop: NamedLoop,
    trajectories: Mapping[Part, Trajectory],
    places: Mapping[Part, Sequence[Place]],
) -> Named:
    found = [_place_at(time, places) for time in loop.times]
    if any(one is None for one in found):
        time = next(t for t, one in zip(loop.times, found, strict=True) if one is None)
        return Named(loop, None, loop.times, f"not used: nothing was seen at {time:g} s")
    (a, place_a), (b, place_b) = (one for one in found if one is not None)
    if place_a is place_b:
        first, last = place_a.span or (np.nan, np.nan)
        said = f"not used: both times are in one stretch, from {first:.1f} to {last:.1f} s"
        return Named(loop, None, loop.times, said)
    middles = middle_of(place_a), middle_of(place_b)
    if not loop.same:
        alike = verified(place_a, place_b, np.eye(4)) if a == b else None
        if alike is not None and _is_one_place(alike):
            said = f"not used: {alike.agreement:.0%} of what both times could see is alike"
            return Named(loop, None, middles, said)
        match = Match(a, b, Candidate(0, 0, 0.0, _SAID_APART), place_a, place_b, _SAID_APART)
        return Named(loop, match, middles, "kept apart")
    T_1, T_2 = (
        _pose(trajectories[part], time) for part, time in zip((a, b), loop.times, strict=True)
    )
    T_given = loop.T_first_second
    if T_given is None:
        # where the estimate has them, and with both times at one point
        here = rigid(np.eye(3), T_1[:3, 3] - T_2[:3, 3])
        candidate = match_pair(place_a, place_b, [np.eye(4), here], settings=_SAID_SAME)
        said = candidate.reason or "agrees with what is seen"
    else:
        candidate, said = _as_given(T_1 @ T_given @ inverse(T_2), place_a, place_b)
    reason = None if candidate.accepted else said
    match = Match(a, b, candidate, place_a, place_b, reason, is_named=True)
    is_seen = candidate.alignment is None or candidate.alignment.n_pairs > 0
    at = middles if is_seen else loop.times
    doubt = f"not used: what both times saw does not fit ({said})"
    return Named(loop, match, at, said if reason is None else doubt)


def _as_given(T: Matrix, a: Place, b: Place) -> tuple[Candidate, str]:
    """Check a given transform by what is seen; where that is too little it is taken as it is."""
    agreement = verified(a, b, T)
    seen = match_pair(a, b, [T], keypoints=False, settings=_SAID_SAME)
    if seen.accepted and seen.alignment is not None and _is_near(seen.alignment.T_a_b, T, b):
        return seen, "agrees with what is seen, which has made it more exact"
    shift, turn = _BY_EYE
    weights = np.diag([turn**-2] * 3 + [shift**-2] * 3) / Alignment.INDEPENDENT
    given = Candidate(0, 0, 0.0, None, 0, Alignment(T, weights, b.centre, 0), agreement)
    if agreement.is_telling:
        why = seen.reason or "what is seen fits another transform"
        return replace(given, reason=why), why
    return given, "taken as given: the two times have too little in sight together to check it"


def _is_near(found: Matrix, given: Matrix, place: Place) -> bool:
    off = inverse(given) @ found
    at = place.centre
    shift = np.linalg.norm(off[:3, :3] @ at + off[:3, 3] - at)
    turn = np.linalg.norm(geometry.log(geometry.from_matrices(off[:3, :3])))
    return bool(shift < _CORRECTED[0] and turn < _CORRECTED[1])


def _place_at(time: float, places: Mapping[Part, Sequence[Place]]) -> tuple[Part, Place] | None:
    for part, own in places.items():
        for place in own:
            if place.span is not None and place.span[0] <= time <= place.span[1]:
                return part, place
    return None


def _pose(trajectory: Trajectory, time: float) -> Matrix:
    at = float(np.clip(time, trajectory.times[0], trajectory.times[-1]))
    positions, quats = trajectory.interpolate(np.array([at]))
    T: Matrix = from_poses(positions, quats)[0]
    return T


def _moves(
    part: Part, time: float, before: Mapping[Part, Trajectory], after: Mapping[Part, Trajectory]
) -> Matrix:
    """Return the transform that takes what was seen at a time to where it is afterwards."""
    T: Matrix = _pose(after[part], time) @ inverse(_pose(before[part], time))
    return T


def _off(
    match: Match,
    at: tuple[float, float],
    poses: Mapping[Part, Trajectory],
    before: Mapping[Part, Trajectory],
) -> float:
    """Return by how much, m, trajectories differ from a loop at the second of two times."""
    first, second = at
    T_1 = _moves(match.a, first, before, poses)
    there = T_1 @ match.alignment.T_a_b @ _pose(before[match.b], second)
    return float(np.linalg.norm(there[:3, 3] - _pose(poses[match.b], second)[:3, 3]))


def denied_by(
    named: Sequence[Named], before: Mapping[Part, Trajectory], after: Mapping[Part, Trajectory]
) -> str | None:
    """Return what a user has denied and the finished trajectory makes one place; None if nothing."""
    for one in named:
        if one.match is None or one.loop.same:
            continue
        match, (first, second) = one.match, one.at
        T = inverse(_moves(match.a, first, before, after)) @ _moves(match.b, second, before, after)
        if _is_one_place(verified(match.place_a, match.place_b, T)):
            return f"it makes {one.loop} one place, which the loops named deny"
    return None


def _is_one_place(agreement: Agreement) -> bool:
    """Whether two places lie on each other, so that one cannot tell them apart."""
    settings = MatchSettings()
    overlaps = agreement.is_telling and agreement.overlap >= settings.min_overlap
    return overlaps and agreement.agreement >= settings.min_agreement
