# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether poses and calibration are as uncertain as stated: shares of errors within 68 % and 95 %, by head.

    python -m benches deviations --flights 60 --first-seed 900 --realism 0 1 3

simulates flights that go through heads and scenes, each with a seed of its own, estimates them with and
without closing their loops, and compares poses, calibration and the expected accuracy of the report with
the truth. Errors of poses are those in flight relative to position and heading of the first pose; honest
covariances have 68 % of them within one and 95 % within 1.96 standard deviations, and mean squares of one. The
errors of a flight go together, so that a share of n flights scatters by about 0.45 / √n. Every flight is
printed as it is measured and kept as JSON; what is there already is not measured again.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benches.support import tables
from benches.support.stated_errors import compared
from bentwing.base.errors import BentwingError
from bentwing.simulate import Scenario, simulate

HEADS = ("hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-side", "vlp16-motor")
SCENES = ("office", "courtyard", "forest", "cave", "mine")
GROUPS = {"roll, pitch": [0, 1], "heading": [2], "horizontal": [3, 4], "vertical": [5]}
BOUNDS = (1.0, 1.959964)
STATES = ("latency", "extrinsic_rotation", "extrinsic_translation", "gyro_bias")
COLUMNS = ("loops", "head", "flights", *(f"{name}: 68 %, 95 %" for name in GROUPS), "mean square")
CALIBRATION = ("loops", *(f"{name}: 68 %, 95 %; mean, median square" for name in STATES))
LOOPS = ("open", "closed")
RESULTS = Path(__file__).parent / "results" / "deviations.json"


def scenario_of(options: argparse.Namespace, realism: float, i: int) -> Scenario:
    """The i-th flight; those that follow each other have other heads and other scenes."""
    turn, at = divmod(i, len(options.heads))
    scene = options.scenes[(turn + at) % len(options.scenes)]
    return Scenario(
        scene=scene,
        head=options.heads[at],
        seed=options.first_seed + i,
        duration=options.duration,
        realism=realism,
    )


def measured(scenario: Scenario, work: Path) -> dict:
    """What became of a flight, by whether its loops were closed: see `compared`."""
    folder = work / f"{scenario.scene}-{scenario.head}-{scenario.seed}-{scenario.realism:g}"
    if not folder.exists():
        simulate(scenario, folder)
    try:
        return compared(folder)
    except BentwingError as error:
        return {loops: {"failure": str(error)} for loops in LOOPS}


def progress(key: str, found: dict) -> str:
    """One line on a flight: errors over standard deviations, root mean squares by group."""
    cells = []
    for loops in LOOPS:
        if "failure" in found[loops]:
            cells.append(f"{loops}: {found[loops]['failure']}")
            continue
        squares = np.mean(np.square(found[loops]["normalized"]), axis=0)
        groups = [f"{np.sqrt(squares[group].mean()):.2f}" for group in GROUPS.values()]
        cells.append(f"{loops}: {', '.join(groups)}")
    return f"{key}: {'; '.join(cells)}"


def row(loops: str, head: str, flights: list[np.ndarray]) -> str:
    """A line of the table; every flight counts alike."""
    if not flights:
        return tables.line([loops, head, "0", *("-" for _ in GROUPS), "-"])
    shares = np.mean([[np.mean(np.abs(z) < b, axis=0) for z in flights] for b in BOUNDS], axis=1)
    cells = [
        ", ".join(f"{share:.0%}" for share in shares[:, group].mean(axis=1))
        for group in GROUPS.values()
    ]
    squares = [np.mean(np.square(z)) for z in flights]
    return tables.line([loops, head, str(len(flights)), *cells, f"{np.mean(squares):.2f}"])


def table(results: list[dict], heads: list[str]) -> str:
    """Shares of the errors by head."""
    lines = [tables.head(COLUMNS)]
    for loops in LOOPS:
        for head in [*heads, "all"]:
            of_head = [r for r in results if head in (r["head"], "all")]
            known = [r["found"][loops] for r in of_head if "failure" not in r["found"][loops]]
            lines.append(row(loops, head, [np.array(f["normalized"]) for f in known]))
    return "\n".join(lines)


def calibration_table(results: list[dict]) -> str:
    """Shares and squares of the errors of slow states, each flight counting alike."""
    lines = [tables.head(CALIBRATION)]
    for loops in LOOPS:
        known = [r["found"][loops] for r in results if "failure" not in r["found"][loops]]
        cells = []
        for name in STATES:
            flights = [np.array(f["calibration"][name]) for f in known if name in f["calibration"]]
            if not flights:
                cells.append("-")
                continue
            shares = [np.mean([np.mean(np.abs(z) < b) for z in flights]) for b in BOUNDS]
            squares = [np.mean(np.square(z)) for z in flights]
            said = ", ".join(f"{share:.0%}" for share in shares)
            cells.append(f"{said}; {np.mean(squares):.2f}, {np.median(squares):.2f}")
        lines.append(tables.line([loops, *cells]))
    return "\n".join(lines)


def sentence_table(results: list[dict]) -> str:
    """How often the truth is below what the sentence in the report says."""
    lines = []
    for loops in LOOPS:
        known = [r["found"][loops] for r in results if "failure" not in r["found"][loops]]
        ratios: dict[str, list[list[float]]] = {}
        for found in known:
            for name, values in found["expected"].items():
                ratios.setdefault(name, []).append(values)
        if not lines:
            lines.append(tables.head(("loops", *ratios)))
        cells = []
        for values in ratios.values():
            filled = [np.array(v) for v in values if v]
            cells.append(f"{np.mean([np.mean(v < 1.0) for v in filled]):.0%}")
        lines.append(tables.line([loops, *cells]))
    return "\n".join(lines)


def main() -> None:
    """Print the tables of each level of realism."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--flights", type=int, default=25)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("--heads", nargs="+", default=list(HEADS))
    parser.add_argument(
        "--realism", nargs="+", type=float, default=[0.0], help="errors of real sensors, 0 to 3"
    )
    parser.add_argument("--duration", type=float, default=25.0, help="of each flight, in s")
    parser.add_argument("--work", type=Path, help="keep the simulated recordings here")
    parser.add_argument("--json", type=Path, default=RESULTS, help="default: %(default)s")
    options = parser.parse_args()
    options.json.parent.mkdir(parents=True, exist_ok=True)
    kept = json.loads(options.json.read_text()) if options.json.exists() else {}
    for realism in options.realism:
        results = measured_at(realism, options, kept)
        print(f"\nrealism {realism:g}\n\n{table(results, options.heads)}")
        print(f"\n{calibration_table(results)}\n\n{sentence_table(results)}\n", flush=True)


def measured_at(realism: float, options: argparse.Namespace, kept: dict[str, dict]) -> list[dict]:
    """What became of all flights at a level; `kept` ones are not flown again."""
    results = []
    for i in range(options.flights):
        scenario = scenario_of(options, realism, i)
        key = " ".join(
            str(getattr(scenario, n)) for n in ("head", "scene", "seed", "duration", "realism")
        )
        if key not in kept:
            with TemporaryDirectory() as scratch:
                found = measured(scenario, options.work or Path(scratch))
            kept[key] = {"head": scenario.head, "found": found}
            options.json.write_text(json.dumps(kept))
            print(progress(key, found), flush=True)
        results.append(kept[key])
    return results
