# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which places of different parts are the same, and which of the matches agree with each other.

A part is a segment of a run: a stretch of trajectory without a break.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bentwing.closing.agreement import Sighting, largest_group
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.places import MatchSettings, match_places

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from bentwing.base.progress import Stage
    from bentwing.closing.joining.survey import Survey
    from bentwing.closing.places import Alignment, Candidate, Place

# Pairs of places of two long runs that are verified, per place: what was seen once is seen again at
# the places around it, and a verification takes a third of a second.
_TRIED = 64
_FEWEST_CANDIDATES = 2


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
    is_named : whether a user has named it, so that nothing but what both places saw speaks against it
    """

    a: Part
    b: Part
    candidate: Candidate
    place_a: Place
    place_b: Place
    reason: str | None
    is_named: bool = False

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


def find_matches(
    parts: dict[Part, list[Place]],
    shown: Stage | None = None,
    compared: Callable[[Part, Part], list[Candidate]] | None = None,
) -> list[Match]:
    """Compare the places of all pairs of parts; those that contradict the others are not believed.

    Parameters
    ----------
    compared : returns what `compare` says of the places of two parts; default: compares them
    """
    compared = compared or (lambda a, b: compare(parts[a], parts[b]))
    found: list[Match] = []
    for a, b in combinations(parts, 2):
        if (of_a := parts[a]) and (of_b := parts[b]):
            candidates = compared(a, b)
            found += consistent(
                [Match(a, b, c, of_a[c.i], of_b[c.j], c.reason) for c in candidates]
            )
        if shown is not None:
            shown.advance(1.0)
    return found


def compare(of_a: Sequence[Place], of_b: Sequence[Place]) -> list[Candidate]:
    """Compare the places of two parts."""
    most = MatchSettings().max_candidates
    n = int(np.clip(_TRIED // max(len(of_a), len(of_b)), _FEWEST_CANDIDATES, most))
    return match_places(of_a, of_b, settings=MatchSettings(max_candidates=n))


def consistent(matches: Sequence[Match]) -> list[Match]:
    """Reject the matches of two parts that contradict the largest group that agrees.

    Where two equally large groups contradict each other neither is believed, nor is a match that
    nothing else speaks for if it is not sure by itself.
    """
    believed = [k for k, m in enumerate(matches) if m.believed]
    if not believed:
        return list(matches)
    group = largest_group([_sighting(matches[k]) for k in believed])
    kept = group.members
    result = list(matches)
    if group.contested:
        for k in believed:
            result[k] = matches[k].rejected(
                "contradicts another match of these two, and nothing shows which one is right"
            )
        return result
    for row in np.flatnonzero(~kept):
        k = believed[row]
        n_against = int((kept & ~group.agree[row]).sum())
        result[k] = matches[k].rejected(
            f"contradicts {n_against} of the {int(kept.sum())} matches of these two that agree"
        )
    if kept.sum() == 1:
        lone = believed[int(np.argmax(kept))]
        result[lone] = _alone(matches[lone])
    return result


def _sighting(match: Match) -> Sighting:
    a, b = match.place_a, match.place_b
    return Sighting(match.alignment.T_a_b, b.centre, middle_of(a), middle_of(b))


def _alone(match: Match) -> Match:
    """Believe a match that no other supports only if it is sure by itself."""
    agreement = match.candidate.agreement
    if agreement is None or agreement.is_sure(MatchSettings()):
        return match
    return match.rejected(
        f"agreement is {agreement.agreement:.3g}, too little for the only match of these two"
    )


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
