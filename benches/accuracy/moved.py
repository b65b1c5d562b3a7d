# SPDX-License-Identifier: MIT OR Apache-2.0
"""Are flights found in the map of another day, and kept out of that of a place built alike.

    python -m benches moved --seeds 101 102 … [--scenes office …] [--heads hokuyo-spin …] [--keep FOLDER]

Of every scene, head and seed one flight is the map and another is found in it, as `bentwing localize` finds
it: by the largest group of places that agree. The true pairs are flights in one world in which boxes stand
elsewhere: 0, 2, 5 and 10 of them, 10 that only the later flight has, and 10 that only the earlier one has. In
false pairs the later flight is between the same walls with other things (office, courtyard, car park), in a
world of another seed, or, of a world large enough, in another part of it.

A pair is found rightly if the group puts the middle of its places within 0.3 m of the truth. `one day` counts what
places make of it that allow for nothing moved, as those that are merged do.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benches.accuracy.places import ELSEWHERE, RIGHT, Flown, error, flown, overlap
from benches.support import tables
from benches.support.place_clouds import FLIGHTS
from bentwing.base.transform import inverse
from bentwing.closing.agreement import Sighting, largest_group
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.localize.localization import SAME_SITE
from bentwing.closing.places import match_places

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.closing.places import Candidate, Place

KINDS = {flight.scene: flight for flight in FLIGHTS}
FURNISHED = ("office", "courtyard", "carpark")
OTHER_WORLD = 50
COLUMNS = (
    "scene, head", "pair", "conflict of the true or likely places", "one day: right, false",
    "another day: right, false", "of",
)  # fmt: skip


class Flights:
    """Flights of one scene, head and seed, flown when they are asked for."""

    def __init__(self, scene: str, head: str, keep: Path | None) -> None:
        self._kind, self._head, self._keep = KINDS[scene], head, keep
        self._flown: dict[tuple[object, ...], Flown] = {}

    def get(self, seed: int, number: int, **world: int) -> Flown:
        key = (seed, number, *world.items())
        if key not in self._flown:
            scenario = self._kind.scenario(seed, number)
            chosen = scenario.model_copy(update={"head": self._head, **world})
            self._flown[key] = flown(chosen, self._keep)
        return self._flown[key]


def pairs(
    scene: str, flights: Flights, seed: int
) -> Iterator[tuple[str, Flown, Flown, np.ndarray | None]]:
    """Yield the name of a pair, the map, the later flight, and the true transform between them."""

    def same(name: str, before: int, after: int) -> tuple[str, Flown, Flown, np.ndarray]:
        a, b = flights.get(seed, 0, boxes=before), flights.get(seed, 1, boxes=after)
        return name, a, b, inverse(a.T_world_map) @ b.T_world_map

    for n in (0, 2, 5, 10):
        yield same(f"{n} moved", n, n)
    yield same("10 added", 0, 10)
    yield same("10 removed", 10, 0)
    a, b = flights.get(seed, 0, boxes=0), flights.get(seed, 1, boxes=0)
    if scene in FURNISHED:
        yield "built alike", a, flights.get(seed, 1, things_seed=seed + OTHER_WORLD), None
    yield "another world", a, flights.get(seed + OTHER_WORLD, 1, boxes=0), None
    T_a_b = inverse(a.T_world_map) @ b.T_world_map
    shares = np.array([[overlap(p, q, T_a_b) for q in b.places] for p in a.places])
    rows = [np.flatnonzero(shares.max(axis=axis) < ELSEWHERE) for axis in (1, 0)]
    if all(map(len, rows)):
        yield "another part of it", a.with_places(rows[0]), b.with_places(rows[1]), None


def placed(candidates: Sequence[Candidate], b: Flown, T_a_b: np.ndarray | None) -> bool | None:
    """Whether the places that agree put the flight where it is; None where they do not place it."""
    found = [c for c in candidates if c.accepted and c.alignment is not None]
    if not found:
        return None
    group = largest_group([sighting(c, b.places) for c in found])
    if group.contested:
        return None
    members = [c for c, is_in in zip(found, group.members, strict=True) if is_in]
    off = [error(c.alignment.T_a_b, T_a_b, b.places[c.j]) for c in members]
    return float(np.median(off)) <= RIGHT


def sighting(c: Candidate, of_b: Sequence[Place]) -> Sighting:
    assert c.alignment is not None  # of those that are accepted
    return Sighting(c.alignment.T_a_b, of_b[c.j].centre, 0.0, middle_of(of_b[c.j]))


def of_one_day(candidates: Sequence[Candidate]) -> list[Candidate]:
    return [c for c in candidates if c.agreement is None or c.agreement.things is None]


def main() -> None:
    """Print a row per kind of pair."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument(
        "--scenes", nargs="+", default=["office", "courtyard", "carpark", "mine", "forest"]
    )
    parser.add_argument("--heads", nargs="+", default=["hokuyo-spin", "vlp16-motor"])
    parser.add_argument("--keep", type=Path, help="keep the flights here, and use those kept")
    chosen = parser.parse_args()
    print(tables.head(COLUMNS), flush=True)
    for scene in chosen.scenes:
        for head in chosen.heads:
            for cells in rows_of(scene, head, chosen.seeds, chosen.keep):
                print(tables.line(cells), flush=True)


def rows_of(scene: str, head: str, seeds: Sequence[int], keep: Path | None) -> Iterator[list[str]]:
    """Yield the rows of one scene and head."""
    verdicts: dict[str, list[tuple[bool | None, bool | None]]] = {}
    conflicts: dict[str, list[float]] = {}
    for seed in seeds:
        for name, a, b, T_a_b in pairs(scene, Flights(scene, head, keep), seed):
            candidates = match_places(a.places, b.places, settings=SAME_SITE)
            verdict = [placed(some, b, T_a_b) for some in (of_one_day(candidates), candidates)]
            verdicts.setdefault(name, []).append((verdict[0], verdict[1]))
            conflicts.setdefault(name, []).extend(likely(candidates, b, T_a_b))
    for name, found in verdicts.items():
        counts = [
            f"{sum(one[k] is True for one in found)}, {sum(one[k] is False for one in found)}"
            for k in range(2)
        ]
        shares = conflicts[name]
        spread = "-"
        if shares:
            ends = (f"{100 * np.quantile(shares, q):.1f}" for q in (0.1, 0.9))
            spread = f"{' to '.join(ends)} %"
        yield [f"{scene}, {head}", name, spread, *counts, f"{len(found)}"]


def likely(candidates: Sequence[Candidate], b: Flown, T_a_b: np.ndarray | None) -> list[float]:
    """Conflicts of pairs that agree: of one world those at the right place, of two all."""
    agreeing = [
        c
        for c in candidates
        if c.alignment is not None
        and c.agreement is not None
        and c.agreement.agreement >= SAME_SITE.min_agreement
    ]
    return [
        c.agreement.conflict
        for c in agreeing
        if T_a_b is None or error(c.alignment.T_a_b, T_a_b, b.places[c.j]) <= RIGHT
    ]
