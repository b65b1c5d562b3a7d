# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the positions of merged runs rest on: the places that they share, and the loops of runs that these close."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence


@dataclass(frozen=True, slots=True)
class Join:
    """Places that two runs have in common.

    Attributes
    ----------
    a, b : numbers of the runs
    n_places : pairs of places that agree
    has_loop : whether the runs hang together without these places, too
    """

    a: int
    b: int
    n_places: int
    has_loop: bool

    @property
    def is_confirmed(self) -> bool:
        """Whether a second place or a loop of runs would show that a place is false."""
        return self.n_places > 1 or self.has_loop

    def described(self, names: Sequence[str]) -> dict[str, Any]:
        """Return what run.json says of it, with the names of all runs."""
        return {
            "runs": [names[self.a], names[self.b]],
            "n_places": self.n_places,
            "has_loop": self.has_loop,
        }


def joins_of(pairs: Iterable[tuple[int, int]]) -> list[Join]:
    """Count the places that runs have in common, and find those without which runs would fall apart.

    Parameters
    ----------
    pairs : the two runs of each match of places that is believed; those within a run do not count
    """
    counts = Counter((min(pair), max(pair)) for pair in pairs if pair[0] != pair[1])
    return [
        Join(a, b, n, _is_reached(a, b, set(counts) - {(a, b)}))
        for (a, b), n in sorted(counts.items())
    ]


def _is_reached(start: int, goal: int, pairs: set[tuple[int, int]]) -> bool:
    """Whether a way leads from one run to the other."""
    seen, fresh = {start}, {start}
    while fresh and goal not in seen:
        fresh = {y for a, b in pairs for x, y in ((a, b), (b, a)) if x in fresh} - seen
        seen |= fresh
    return goal in seen
