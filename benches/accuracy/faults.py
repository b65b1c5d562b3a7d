# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a run knows when it is wrong: recordings of wrongly set-up heads, and good ones.

    python -m benches faults --scenes office --heads hokuyo-spin --seeds 1 2 --good 8

simulates flights, puts each fault into them, maps them by the command line, compares path and map with
the truth and with the same flight without the fault, and prints what became of them. Good recordings,
some with events, must be called good. `--payload none` maps without any payload. Every run is kept as
JSON with its evidence.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, get_args

from benches.support import tables
from benches.support.fault_outcomes import OUTCOMES
from benches.support.fault_runs import Flight, row_of
from bentwing.simulate import Scenario
from bentwing.simulate.faults import FAULTS
from bentwing.simulate.names import EventName

if TYPE_CHECKING:
    from collections.abc import Iterator

HEADS = ("hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-motor")
SCENES = ("courtyard", "office", "cave")
RESULTS = Path(__file__).parent / "results" / "faults.json"
HEADS_OF = {
    "motor-reversal": ("vlp16-motor",),
    "spin-stall": ("hokuyo-spin", "hokuyo-nod", "vlp16-motor"),
    "gusts": ("hokuyo-spin", "vlp16-fixed", "vlp16-motor"),
}
"""Events that happen to some heads only."""
PAYLOAD_ONLY = {*(name for name in FAULTS if name.startswith("mount")), "encoder-axis"}


def flight_of(options: argparse.Namespace, work: Path, scene: str, head: str, seed: int, **more):
    """A flight in the folder for all of them."""
    scenario = Scenario(scene=scene, head=head, seed=seed, duration=options.duration, **more)
    name = "-".join([scene, head, str(seed), scenario.spin, *scenario.events])
    words = ("--trust-payload",) if options.trust_payload else ()
    return Flight(scenario, work / name, words)


def flights(options: argparse.Namespace, work: Path) -> Iterator[tuple[Flight, list[str]]]:
    """All flights, each with the faults to put into it."""
    if options.faults or not options.good:
        for scene, head, seed in product(options.scenes, options.heads, options.seeds):
            chosen = [name for name in options.faults if head in FAULTS[name].heads]
            yield flight_of(options, work, scene, head, seed), chosen
    for i in range(options.good):
        yield good_flight(options, work, i), []


def good_flight(options: argparse.Namespace, work: Path, i: int) -> Flight:
    """The i-th of the good flights, which go through heads, scenes and what happens to them."""
    turn, at = divmod(i, len(options.heads))
    head = options.heads[at]
    scene = options.scenes[turn % len(options.scenes)]
    happening = happenings(head)[turn % len(happenings(head))]
    return flight_of(options, work, scene, head, options.seeds[0] + turn, **happening)


def happenings(head: str) -> list[dict]:
    """What happens to good recordings of a head, as fields of a scenario."""
    events = [name for name in get_args(EventName) if head in HEADS_OF.get(name, HEADS)]
    spun = [{"spin": "plant"}] if head == "hokuyo-spin" else []
    return [{}, *({"events": (name,)} for name in events), *spun]


def rows(options: argparse.Namespace, work: Path) -> Iterator[dict]:
    """All runs."""
    has_payload = options.payload == "given"
    for flight, faults in flights(options, work):
        yield row_of(flight, flight.good, None)
        if not has_payload:
            yield row_of(flight, flight.mapped(flight.folder, payload=False), None, payload=False)
        for name in faults:
            if has_payload or name not in PAYLOAD_ONLY:
                result = flight.with_fault(name, payload=has_payload)
                yield row_of(flight, result, name, payload=has_payload)


def progress(row: dict) -> str:
    """One line on a run while the bench goes on."""
    error, good = row["error"] or {}, row["good"] or {}
    names = ("path", "map")
    figures = ", ".join(
        f"{name} {tables.given(error.get(name), 100, 'cm')} ({tables.given(good.get(name), 100, 'cm')})"
        for name in names
    )
    what = row["fault"] or "+".join(["good", *row["events"]])
    where = f"{row['scene']} {row['head']} {row['seed']}"
    told = f"{row['state']}, {row['outcome'] or '-'}"
    return f"{where}, payload {row['payload']}: {what}: {figures}: {told}"


def table(results: list[dict]) -> str:
    """How often each fault came to which end."""
    lines = [tables.head(("fault", "to repair", *OUTCOMES))]
    faulty = [row for row in results if row["fault"]]
    for name in dict.fromkeys(row["fault"] for row in faulty):
        of_fault = [row for row in faulty if row["fault"] == name]
        counts = Counter(row["outcome"] for row in of_fault)
        cells = [str(counts[one]) if counts[one] else "" for one in OUTCOMES]
        lines.append(tables.line([name, FAULTS[name].repair, *cells]))
    counts = Counter(row["outcome"] for row in faulty)
    lines.append(tables.line(["all", "", *(str(counts[one]) for one in OUTCOMES)]))
    return "\n".join(lines)


def summary(results: list[dict]) -> str:
    """The shares that matter."""
    faulty = [row for row in results if row["fault"]]
    repairable = [row for row in faulty if row["repair"] != "none"]
    told = [row for row in faulty if (row["outcome"] or "").endswith("reason")]
    good = [row for row in results if not row["fault"] and row["payload"] == "given"]
    bare = [row for row in results if not row["fault"] and row["payload"] == "none"]
    lines = [
        ("silently wrong", faulty, lambda row: row["outcome"] == "silently wrong"),
        ("repairable faults mapped right", repairable, lambda row: row["outcome"] in ("right", "repaired")),
        ("refusals that name the cause", told, lambda row: row["outcome"] == "right reason"),
        ("good recordings called otherwise", good, lambda row: row["state"] != "good"),
        ("without payload as with it", bare, lambda row: row["outcome"] == "right"),
    ]  # fmt: skip
    return "\n".join(
        f"{what}: {sum(map(holds, of))} of {len(of)}" for what, of, holds in lines if of
    )


def parsed() -> argparse.Namespace:
    """What is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--faults", nargs="*", choices=list(FAULTS), default=list(FAULTS), metavar="NAME", help="default: all; without a name: none")  # fmt: skip
    parser.add_argument("--heads", nargs="+", default=list(HEADS))
    parser.add_argument("--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0])
    parser.add_argument("--duration", type=float, default=24.0, help="of each flight, in s")
    parser.add_argument("--good", type=int, default=0, metavar="N", help="good recordings, with events as well")  # fmt: skip
    parser.add_argument("--payload", choices=["given", "none"], default="given")
    parser.add_argument("--trust-payload", action="store_true", help="repair nothing: what the verdict alone says")  # fmt: skip
    parser.add_argument("--work", type=Path, help="keep the simulated recordings here")
    parser.add_argument("--json", type=Path, default=RESULTS, help="default: %(default)s")
    return parser.parse_args()


def main() -> None:
    """Print the table."""
    options = parsed()
    options.json.parent.mkdir(parents=True, exist_ok=True)
    results = []
    with TemporaryDirectory() as scratch:
        for row in rows(options, options.work or Path(scratch)):
            print(progress(row), file=sys.stderr, flush=True)
            results.append(row)
            options.json.write_text(json.dumps(results))
    if any(row["fault"] for row in results):
        print(f"{table(results)}\n")
    print(summary(results))
