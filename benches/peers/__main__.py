# SPDX-License-Identifier: MIT OR Apache-2.0
"""bentwing and other engines on the same recordings: errors, cost and memory in one table.

Recordings are folders that `bentwing simulate` wrote, or are simulated here; a file (a bag, an
MCAP) is a recording without truth, of which the end and the thickness of walls are compared.
Every engine runs in a process of its own, one after the other on each recording. Prints Markdown
and keeps all numbers as JSON.
"""

from __future__ import annotations

import argparse
import tempfile
from importlib import metadata
from itertools import product
from pathlib import Path

from benches.peers import scoring, table, without_truth
from benches.peers.engines import ENGINES
from benches.peers.prepare import prepare
from benches.peers.runner import Source, run, short
from benches.support import tables
from benches.support.cost import bentwing
from benches.support.tables import keep
from bentwing.base.errors import BentwingError
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.simulated import Truth, mapped_points
from bentwing.recording import Payload, Recording

RESULTS = Path(__file__).parent / "results" / "peers.json"


def main() -> None:
    """Print the table."""
    options = parsed()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.keep or Path(scratch)
        recordings = [*options.recordings, *simulated(options, folder / "simulated")]
        withtruth = [path for path in recordings if path.is_dir()]
        results = on_simulated(withtruth, options, folder) if withtruth else []
        files = [path for path in recordings if not path.is_dir()]
        results += without_truth.compare(files, options, folder) if files else []
    keep({"versions": versions(), "results": results}, options.json)


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(prog="python -m benches peers", description=__doc__)
    add = parser.add_argument
    add("--recordings", nargs="+", type=Path, default=[], metavar="FOLDER or FILE")
    add("--payload", type=Path, help="of recordings that are files; default: a lidar alone")
    add("--scenes", nargs="+", default=[], help="to simulate")
    add("--heads", nargs="+", default=["vlp16-fixed", "hokuyo-spin"])
    add("--seeds", nargs="+", type=int, default=[0])
    add("--duration", type=float, default=60.0, help="of each simulated flight, in s")
    add("--motor-rate", type=float, default=1.0, help="of simulated motors, in rad/s")
    add("--engines", nargs="+", default=list(ENGINES), choices=list(ENGINES), metavar="ENGINE")
    add("--repeats", type=int, default=1, help="rounds of all engines; the middle is shown")
    add("--timeout", type=float, default=900.0, help="s of wall time for one engine")
    add("--stamps", action="store_true", help="also how well the assumed pose stamps fit")
    add("--keep", type=Path, help="keep scans, poses and logs in this folder")
    add("--json", type=Path, default=RESULTS, help="default: %(default)s")
    options = parser.parse_args()
    if not options.recordings and not options.scenes:
        parser.error("give --recordings or --scenes")
    if missing := [str(path) for path in options.recordings if not path.exists()]:
        parser.error(f"no such recording: {', '.join(missing)}")
    return options


def simulated(options: argparse.Namespace, folder: Path) -> list[Path]:
    """Flights made for this table."""
    made = []
    for scene, head, seed in product(options.scenes, options.heads, options.seeds):
        out = folder / f"{scene}, {head}, {seed}"
        choices = ["--head", head, "--seed", str(seed), "--duration", f"{options.duration:g}"]
        choices += ["--motor-rate", f"{options.motor_rate:g}"]
        bentwing("simulate", scene, "-o", out, *choices)
        made.append(out)
    return made


def on_simulated(folders: list[Path], options: argparse.Namespace, scratch: Path) -> list[dict]:
    """All engines on recordings with truth."""
    print(tables.head(table.COLUMNS))
    results = []
    for number, recording in enumerate(folders):
        results += on_one(recording, options, scratch / f"{number}-{recording.name}")
    print(f"\n{table.NOTES}")
    if options.stamps:
        print(tables.head(table.STAMPS_COLUMNS))
        print("\n".join(table.stamps_row(r) for r in results if r["score"] and not r["failure"]))
    return results


def on_one(folder: Path, options: argparse.Namespace, scratch: Path) -> list[dict]:
    """Rounds of engines on one recording; a row is printed when the last round has run it."""
    truth = Truth(folder)
    payload, path = folder / "payload.yaml", next(folder.glob("recording*"))
    with Recording(path, Payload.load(payload)) as recording:
        source = Source(folder.name, path, payload, recording.duration)
    feed = prepare(path, Payload.load(payload), scratch / "feed", truth.calibration.latency)
    rounds: dict[str, list[dict]] = {name: [] for name in options.engines}
    for number, name in product(range(options.repeats), options.engines):
        out = scratch / f"{name}-{number}"
        result = run(ENGINES[name], source, feed, out, options.timeout)
        if result["failure"] is None:
            result["score"] = scored(name, feed, out, truth)
            result["failure"] = result["score"].pop("failure", None)
        rounds[name].append(result)
        if number == options.repeats - 1:
            print(table.row(table.middle(rounds[name])), flush=True)
    return [result for name in options.engines for result in rounds[name]]


def scored(name: str, feed, out: Path, truth: Truth) -> dict:
    """Numbers of merit; what goes wrong with an engine's poses is a result, too."""
    engine = ENGINES[name]
    try:
        if engine.adapter is None:
            estimate, _ = read_tum(out / "run" / "trajectory.txt", truth.origin_ns)
            laz = out / "run" / "map.laz"
            return scoring.score(
                estimate,
                truth,
                lambda: mapped_points(laz, truth.origin_ns, truth.flight),
            )
        estimate = scoring.peer_trajectory(out / "poses.npz", feed, engine, truth.origin_ns)
        return scoring.score(estimate, truth, lambda: scoring.peer_points(estimate, feed, truth))
    except (BentwingError, ValueError, ArithmeticError, OSError) as error:
        return {"failure": short(f"lost: {error}")}


def versions() -> dict[str, str]:
    """Of all packages that were compared."""
    return {package: version(package) for package in sorted({e.package for e in ENGINES.values()})}


def version(package: str) -> str:
    """Of one."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "from source" if package == "bentwing" else "not installed"


if __name__ == "__main__":
    main()
