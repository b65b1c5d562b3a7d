# SPDX-License-Identifier: MIT OR Apache-2.0
"""A flight localized in the map of another one, against the truth of both.

    python -m benches localize courtyard office --seeds 871 872

Errors are those in the frame that the first flight's map has against its truth, nothing is aligned again.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path

from benches.support import tables
from bentwing.evaluate.simulated import localized_score
from bentwing.run.pipeline import map_recording
from bentwing.simulate import Scenario, simulate

COLUMNS = (
    "scene, seed", "map given", "across the spin axis", "along it", "map", "appeared", "time",
)  # fmt: skip


def main() -> None:
    args = parsed()
    print(tables.head(COLUMNS))
    with tempfile.TemporaryDirectory() as folder:
        for scene in args.scenes:
            for seed in args.seeds:
                compare(scene, seed, Path(folder) / f"{scene}-{seed}", args.duration)


def compare(scene: str, seed: int, folder: Path, duration: float) -> None:
    """Map one flight, localize another one in it, and print a row for the run and for its cloud."""
    recordings = [folder / f"flight{n}" for n in (1, 2)]
    for n, out in enumerate(recordings, 1):
        simulate(Scenario(scene=scene, seed=seed, flight_seed=n, duration=duration), out)
    site = folder / "site"
    map_recording(recordings[0] / "recording.bag", recordings[0] / "payload.yaml", site)
    for prior in (site, site / "map.laz"):
        out, started = folder / f"in-{prior.stem}", time.perf_counter()
        payload = recordings[1] / "payload.yaml"
        map_recording(recordings[1] / "recording.bag", payload, out, prior_map=prior)
        elapsed = time.perf_counter() - started
        found = localized_score(out, recordings[1], site, recordings[0])
        record = json.loads((out / "run.json").read_text())["localization"]
        cells = [
            f"{scene}, {seed}", "run" if prior == site else "cloud",
            f"{100 * found.across:.2f} cm", f"{100 * found.along:.2f} cm",
            f"{100 * found.map_std:.2f} cm", f"{record['appeared']}", f"{elapsed:.0f} s",
        ]  # fmt: skip
        print(tables.line(cells), flush=True)


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=["courtyard", "office", "forest", "cave"])
    parser.add_argument("--seeds", nargs="+", type=int, default=[1])
    parser.add_argument("--duration", type=float, default=40.0)
    return parser.parse_args()
