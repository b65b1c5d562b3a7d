# SPDX-License-Identifier: MIT OR Apache-2.0
"""What run.json says about a merging: every pair of places that was considered, with the reason."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from bentwing.closing.joining.matches import Match, Part
    from bentwing.closing.places import Place


def describe_parts_of(names: Sequence[str], parts: dict[Part, list[Place]]) -> list[dict[str, Any]]:
    """Return the segments of the runs with their places."""
    return [
        {
            "run": names[part.run],
            "segment": part.segment,
            "places": [place.span for place in places],
        }
        for part, places in parts.items()
    ]


def describe_match(names: Sequence[str], match: Match) -> dict[str, Any]:
    """Return one pair of places: what speaks for it, and why it is believed or not."""
    c = match.candidate
    described: dict[str, Any] = {
        "a": names[match.a.run],
        "b": names[match.b.run],
        "segment_a": match.a.segment,
        "segment_b": match.b.segment,
        "span_a": match.place_a.span,
        "span_b": match.place_b.span,
        "accepted": match.believed,
        "reason": match.reason,
        "votes": round(c.votes, 1),
        "n_inliers": c.n_inliers,
    }
    if c.agreement is not None:
        described["overlap"] = round(c.agreement.overlap, 3)
        described["agreement"] = round(c.agreement.agreement, 3)
        described["distance"] = c.agreement.distance
    if c.alignment is not None:
        described["T_a_b"] = c.alignment.T_a_b
    return described


def describe_matches(names: Sequence[str], matches: Iterable[Match]) -> list[dict[str, Any]]:
    """Return all of them, believed ones first, then those that came farthest."""
    ordered = sorted(matches, key=lambda m: (not m.believed, -m.candidate.n_inliers))
    return [describe_match(names, match) for match in ordered]
