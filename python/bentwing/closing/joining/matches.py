# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which places of different parts are the same, and which of the matches agree with each other.

A part is a segment of a run: a stretch of trajectory without a break.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.base.transform import apply, inverse
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.places import MatchSettings, match_places

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.base.progress import Stage
    from bentwing.closing.joining.survey import Survey
    from bentwing.closing.places import Alignment, Candidate, Place

# Pairs of places of two long runs that are verified, per place: what was seen once is seen again at
# the places around it, and a verification takes a third of a second.
_TRIED = 64
_FEWEST_CANDIDATES = 2
# Matches of two parts contradict each other if they put a place farther apart than this, m, and in
# proportion to the time between them, m/s, in which both parts may have drifted.
_APART = 0.4
_DRIFT = 0.005
_TURNED = np.radians(2.0)
_TURN_DRIFT = np.radians(0.02)


class Part(NamedTuple):
    """A segment of a run, by their numbers."""

    run: int
    segment: int


@dataclass(frozen=True, slots=True)
class Match:
    """Two places of different parts that were compared.

    Attributes
    ----------
    a, b : the parts
    candidate : the places, by their numbers in the part, and what was found
    place_a, place_b : the places
    reason : why it is not believed, None if it is
    """

    a: Part
    b: Part
    candidate: Candidate
    place_a: Place
    place_b: Place
    reason: str | None

    @property
    def believed(self) -> bool:
        """Whether it links the parts."""
        return self.reason is None

    @property
    def alignment(self) -> Alignment:
        """What leads from the map of b's run to that of a's."""
        if self.candidate.alignment is None:
            msg = "alignment: this match was never aligned"
            raise ValueError(msg)
        return self.candidate.alignment

    def rejected(self, reason: str) -> Match:
        """Return the same, not believed."""
        return replace(self, reason=reason)


def parts_of(surveys: Sequence[Survey]) -> dict[Part, list[Place]]:
    """Return the places of each part, in order; parts without places, too."""
    parts: dict[Part, list[Place]] = {
        Part(r, s): [] for r, one in enumerate(surveys) for s in range(len(one.recorded.segments))
    }
    for r, one in enumerate(surveys):
        for place, segment in zip(one.places, one.segments, strict=True):
            parts[Part(r, segment)].append(place)
    return parts


def find_matches(parts: dict[Part, list[Place]], shown: Stage | None = None) -> list[Match]:
    """Compare the places of all pairs of parts; those that contradict the others are not believed."""
    found: list[Match] = []
    for a, b in combinations(parts, 2):
        if parts[a] and parts[b]:
            found += consistent(_between(a, b, parts[a], parts[b]))
        if shown is not None:
            shown.advance(1.0)
    return found


def _between(a: Part, b: Part, of_a: Sequence[Place], of_b: Sequence[Place]) -> list[Match]:
    most = MatchSettings().max_candidates
    n = int(np.clip(_TRIED // max(len(of_a), len(of_b)), _FEWEST_CANDIDATES, most))
    settings = replace(MatchSettings(), max_candidates=n)
    return [
        Match(a, b, c, of_a[c.i], of_b[c.j], c.reason)
        for c in match_places(of_a, of_b, settings=settings)
    ]


def consistent(matches: Sequence[Match]) -> list[Match]:
    """Reject the matches of two parts that contradict the largest group that agrees.

    A match is compared by where it puts the place of another one (Mangelson et al. 2018, pairwise
    consistency). Where two equally large groups contradict each other neither is believed, nor is a
    match that nothing else speaks for if it is not sure by itself.
    """
    believed = [k for k, m in enumerate(matches) if m.believed]
    if not believed:
        return list(matches)
    agree = np.array([[_agree(matches[p], matches[q]) for q in believed] for p in believed])
    kept = _largest_group(agree)
    rivals = np.flatnonzero(~kept)
    result = list(matches)
    if len(rivals) and _largest_group(agree[np.ix_(rivals, rivals)]).sum() >= kept.sum():
        for k in believed:
            result[k] = matches[k].rejected(
                "contradicts another match of these two, and nothing tells which one is right"
            )
        return result
    for row in rivals:
        k = believed[row]
        n_against = int((kept & ~agree[row]).sum())
        result[k] = matches[k].rejected(
            f"contradicts {n_against} of the {int(kept.sum())} matches of these two that agree"
        )
    if kept.sum() == 1:
        lone = believed[int(np.argmax(kept))]
        result[lone] = _alone(matches[lone])
    return result


def _alone(match: Match) -> Match:
    """Believe a match that no other supports only if it is sure by itself."""
    agreement = match.candidate.agreement
    if agreement is None or agreement.is_sure(MatchSettings()):
        return match
    return match.rejected(
        f"agreement is {agreement.agreement:.3g}, too little for the only match of these two"
    )


def _agree(p: Match, q: Match) -> bool:
    """Whether two matches may both be true."""
    elapsed = abs(middle_of(p.place_a) - middle_of(q.place_a)) + abs(
        middle_of(p.place_b) - middle_of(q.place_b)
    )
    T_p, T_q = p.alignment.T_a_b, q.alignment.T_a_b
    centres = np.stack([p.place_b.centre, q.place_b.centre])
    shifts = np.linalg.norm(apply(T_p, centres) - apply(T_q, centres), axis=1)
    turn = np.arccos(np.clip((np.trace((inverse(T_p) @ T_q)[:3, :3]) - 1) / 2, -1.0, 1.0))
    near = float(shifts.min()) <= _APART + _DRIFT * elapsed
    return bool(near and turn <= _TURNED + _TURN_DRIFT * elapsed)


def _largest_group(agree: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Members (M,) of a large group in which all agree, grown from the best supported one."""
    kept = np.zeros(len(agree), dtype=np.bool_)
    candidates = np.ones(len(agree), dtype=np.bool_)
    while candidates.any():
        support = (agree & candidates).sum(axis=1)
        best = int(np.argmax(np.where(candidates, support, -1)))
        kept[best] = True
        candidates &= agree[best]
        candidates[best] = False
    return kept


def connected(parts: Iterable[Part], matches: Iterable[Match]) -> list[list[Part]]:
    """Return the groups of parts that believed matches connect, each in order."""
    group = {part: part for part in parts}

    def root(part: Part) -> Part:
        while group[part] != part:
            part = group[part]
        return part

    for match in matches:
        if match.believed:
            first, second = sorted((root(match.a), root(match.b)))
            group[second] = first
    groups: dict[Part, list[Part]] = {}
    for part in sorted(group):
        groups.setdefault(root(part), []).append(part)
    return list(groups.values())
