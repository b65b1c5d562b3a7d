# SPDX-License-Identifier: MIT OR Apache-2.0
"""Do runs find each other: recall and false merges over pairs of simulated runs.

    python -m benches places --seeds 821 822 … [--scenes office …] [--keep FOLDER] [--rejected]
                             [--peer PYTHON]

Of every scene and seed two flights are flown in the same world. Three sorts of pairs are merged as
`bentwing merge` does it, matches that contradict each other and the pose graph included:

- overlapping: the two flights in one world, if two of their places share `OVERLAPPING` of their
  surfels by the true poses; they should become one map;
- elsewhere: of these two flights only the places that share less than `ELSEWHERE` with every place
  of the other; they should stay apart;
- other worlds: flights in worlds of neighbouring seeds, which should stay apart.

A match, and a merge, is false if it puts the middle of a place more than `RIGHT` from where it
belongs; between worlds of different seeds any is. With --rejected the pairs of overlapping places that were
not believed are listed with the reason. With --peer the same flights go through MapClosures, which the
interpreter PYTHON has (`pip install map-closures`); see `place_peer`.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from benches.support import tables
from benches.support.place_clouds import FLIGHTS, kept_run
from benches.support.place_peer import Peer
from bentwing.base.mount import Pose
from bentwing.base.transform import apply, inverse
from bentwing.closing.joining.matches import Match, Part, find_matches
from bentwing.closing.joining.placing import place_groups
from bentwing.closing.joining.survey import middle_of
from bentwing.closing.places import Place, PlaceSettings, cut_places, describe_parts

if TYPE_CHECKING:
    from benches.support.place_clouds import FlightKind
    from bentwing.base.trajectory import Trajectory
    from bentwing.simulate import Scenario

RIGHT = 0.3
OVERLAPPING = 0.4
ELSEWHERE = 0.05
A, B = Part(0, 0), Part(1, 0)


@dataclass(frozen=True, slots=True)
class Flown:
    """A flight as `merge` sees it, the clouds of its places, and the truth about its frame."""

    places: list[Place]
    clouds: list[np.ndarray]
    trajectory: Trajectory
    T_world_map: np.ndarray

    def with_places(self, rows) -> Flown:
        places, clouds = [self.places[k] for k in rows], [self.clouds[k] for k in rows]
        return Flown(places, clouds, self.trajectory, self.T_world_map)

    def cloud(self) -> np.ndarray:
        return np.concatenate(self.clouds)


@dataclass(slots=True)
class Outcome:
    """What became of two flights.

    Attributes
    ----------
    matches : all that were considered
    right, false : believed matches by whether they are true
    merged : into one map
    error : m, of that map, at the worst of the matched places; NaN if the flights stayed apart
    seconds : processor time
    """

    matches: list[Match]
    right: int
    false: int
    merged: bool
    error: float
    seconds: float

    @property
    def rightly(self) -> bool:
        return self.merged and self.error <= RIGHT and self.false == 0


@dataclass(slots=True)
class Tally:
    """Counts of one scene."""

    overlapping: int = 0
    merged: int = 0
    false_matches: int = 0
    elsewhere: int = 0
    merged_elsewhere: int = 0
    others: int = 0
    merged_others: int = 0
    seconds: list[float] = field(default_factory=list)

    def cells(self) -> list[str]:
        return [
            f"{self.merged} of {self.overlapping}",
            f"{self.false_matches}",
            f"{self.merged_elsewhere} of {self.elsewhere}",
            f"{self.merged_others} of {self.others}",
            f"{np.median(self.seconds or [np.nan]):.1f} s",
        ]


COLUMNS = (
    "scene", "overlapping pairs merged", "false matches", "pairs elsewhere merged",
    "pairs of other worlds merged", "processor time per pair",
)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", required=True)
    parser.add_argument("--scenes", nargs="+", default=[flight.scene for flight in FLIGHTS])
    parser.add_argument("--keep", type=Path, help="keep the flights here, and use those kept")
    parser.add_argument(
        "--rejected", action="store_true", help="list what was not believed, and why"
    )
    parser.add_argument("--peer", help="an interpreter with map-closures, for the same flights")
    chosen = parser.parse_args()
    peer = None if chosen.peer is None else Peer(chosen.peer)
    tallies = {
        flight.scene: of_scene(flight, chosen, peer)
        for flight in FLIGHTS
        if flight.scene in chosen.scenes
    }
    print(f"\n| {' | '.join(COLUMNS)} |\n|{'---|' * len(COLUMNS)}")
    for scene, tally in tallies.items():
        print(tables.line([scene, *tally.cells()]))
    print(tables.line(["all", *total(tallies.values()).cells()]))
    if peer is not None:
        peer.close()
        print(f"\n{peer.table()}")


def of_scene(flight: FlightKind, chosen: argparse.Namespace, peer: Peer | None) -> Tally:
    """Compare the flights of one scene."""
    tally, before = Tally(), None
    for seed in chosen.seeds:
        flights = [flown(flight.scenario(seed, number), chosen.keep) for number in range(2)]
        same_world(f"{flight.scene} {seed}", *flights, tally, peer, rejected=chosen.rejected)
        if before is not None:
            outcome = merged(before, flights[1], None)
            tally.others += 1
            tally.merged_others += outcome.merged
            report(f"{flight.scene} {seed}, other world", outcome)
            if peer is not None:
                peer.compare("other worlds", before.cloud(), flights[1].cloud(), None)
        before = flights[0]
    return tally


def flown(scenario: Scenario, keep: Path | None) -> Flown:
    run = kept_run(scenario, keep)
    parts = cut_places(run.points, run.times, run.trajectory)
    clouds = [part.points[:: -(-len(part.points) // PlaceSettings().max_points)] for part in parts]
    return Flown(describe_parts(parts), clouds, run.trajectory, run.T_world_map)


def same_world(
    name: str, a: Flown, b: Flown, tally: Tally, peer: Peer | None, *, rejected: bool
) -> None:
    """Merge two flights in one world, and what of them is elsewhere."""
    T_a_b = inverse(a.T_world_map) @ b.T_world_map
    shares = np.array([[overlap(p, q, T_a_b) for q in b.places] for p in a.places])
    outcome = merged(a, b, T_a_b)
    report(f"{name}, overlap {shares.max():.2f}", outcome)
    tally.false_matches += outcome.false
    tally.seconds.append(outcome.seconds)
    if shares.max() >= OVERLAPPING:
        tally.overlapping += 1
        tally.merged += outcome.rightly
        if peer is not None:
            peer.itself(a.cloud())
            peer.compare("overlapping", a.cloud(), b.cloud(), T_a_b)
    if rejected:
        list_rejected(outcome.matches, shares, T_a_b)
    apart = [np.flatnonzero(shares.max(axis=axis) < ELSEWHERE) for axis in (1, 0)]
    if all(map(len, apart)):
        a, b = a.with_places(apart[0]), b.with_places(apart[1])
        outcome = merged(a, b, T_a_b)
        tally.elsewhere += 1
        if peer is not None:
            peer.compare("elsewhere", a.cloud(), b.cloud(), None)
        tally.merged_elsewhere += outcome.merged
        report(f"{name}, elsewhere", outcome)


def merged(a: Flown, b: Flown, T_a_b: np.ndarray | None) -> Outcome:
    """Merge two flights as `bentwing merge` does; `T_a_b` is the truth, None where there is none."""
    places, ways = {A: a.places, B: b.places}, {A: a.trajectory, B: b.trajectory}
    began = time.process_time()
    groups, matches = place_groups(ways, places, find_matches(places))
    seconds = time.process_time() - began
    believed = [m for m in matches if m.believed]
    errors = [error(m.alignment.T_a_b, T_a_b, m.place_b) for m in believed]
    right = sum(e <= RIGHT for e in errors)
    worst = np.nan
    if len(groups) == 1:
        moved = groups[0].trajectories
        worst = max(error(placed(moved[A], a, moved[B], b, m), T_a_b, m.place_b) for m in believed)
    return Outcome(matches, right, len(errors) - right, len(groups) == 1, float(worst), seconds)


def placed(moved_a: Trajectory, a: Flown, moved_b: Trajectory, b: Flown, m: Match) -> np.ndarray:
    """T_a_b where two matched places are, in the merged map."""
    T_map_a = moved_by(moved_a, a.trajectory, middle_of(m.place_a))
    T_map_b = moved_by(moved_b, b.trajectory, middle_of(m.place_b))
    return inverse(T_map_a) @ T_map_b


def moved_by(after: Trajectory, before: Trajectory, at: float) -> np.ndarray:
    poses = (t.interpolate(np.array([at])) for t in (after, before))
    T_after, T_before = (Pose(p[0], q[0]).matrix for p, q in poses)
    return T_after @ inverse(T_before)


def report(name: str, outcome: Outcome) -> None:
    verdict = f"merged, {1e3 * outcome.error:.0f} mm off" if outcome.merged else "apart"
    print(
        f"{name}: {verdict}; {outcome.right} right and {outcome.false} false matches of "
        f"{len(outcome.matches)} candidates, {outcome.seconds:.1f} s",
        flush=True,
    )


def list_rejected(matches: list[Match], shares: np.ndarray, T_a_b: np.ndarray) -> None:
    """Say of each pair of places that overlap, but are not linked, what was wrong."""
    tried = {(m.candidate.i, m.candidate.j): m for m in matches}
    for i, j in np.argwhere(shares >= OVERLAPPING):
        match = tried.get((int(i), int(j)))
        if match is None:
            print(f"  {i}-{j} share {shares[i, j]:.2f}: no votes")
            continue
        if match.believed:
            continue
        c, off = match.candidate, ""
        if c.alignment is not None:
            off = f"; {error(c.alignment.T_a_b, T_a_b, match.place_b):.2f} m off"
        print(f"  {i}-{j} share {shares[i, j]:.2f}, {c.votes:.0f} votes: {match.reason}{off}")


def overlap(p: Place, q: Place, T: np.ndarray) -> float:
    """Share of one place's surfels with one of the other's within 0.5 m, by the true transform.

    The larger of the two shares.
    """
    means = p.surfels.means, apply(T, q.surfels.means)
    found = [
        cKDTree(one).query(other, distance_upper_bound=0.5)[0]
        for one, other in (means, means[::-1])
    ]
    return float(max(np.isfinite(distances).mean() for distances in found))


def error(found: np.ndarray, true: np.ndarray | None, place: Place) -> float:
    """Distance (m) between where two transforms put the middle of a place."""
    if true is None:
        return np.inf
    return float(np.linalg.norm((found - true) @ np.append(place.centre, 1.0)))


def total(tallies) -> Tally:
    result = Tally()
    for tally in tallies:
        for name in Tally.__slots__:
            setattr(result, name, getattr(result, name) + getattr(tally, name))
    return result
