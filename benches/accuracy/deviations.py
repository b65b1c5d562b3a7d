# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether poses are as uncertain as stated: shares of errors within 68 % and 95 %, by head.

Each flight is simulated and estimated, in open loop and with its loops closed. Errors are those in flight
relative to position and heading of the first pose; honest covariances have 68 % of them within one and
95 % within 1.96 standard deviations.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter, defaultdict
from itertools import product
from pathlib import Path

import numpy as np

from benches.support import tables
from bentwing import odometry
from bentwing.base.progress import Progress
from bentwing.base.trajectory import read_tum
from bentwing.closing.global_registration import close_loops
from bentwing.evaluate.nees import normalized_pose_errors
from bentwing.evaluate.simulated import in_flight
from bentwing.recording import Payload, Recording
from bentwing.recording.preprocess import RecordingPart
from bentwing.simulate import Scenario, simulate

HEADS = ("hokuyo-spin", "hokuyo-nod", "vlp16-fixed", "vlp16-side", "vlp16-motor")
SCENES = ("office", "courtyard", "mine", "forest", "carpark")
GROUPS = {"tilt": [0, 1], "heading": [2], "horizontal": [3, 4], "vertical": [5]}
BOUNDS = (1.0, 1.959964)
COLUMNS = ("loops", "head", "flights", *(f"{name}, 68 %, 95 %" for name in GROUPS))


def normalized(scenario: Scenario, folder: Path) -> dict[str, np.ndarray]:
    """Errors (K, 6) over their standard deviations, of the open and the closed loop."""
    files = simulate(scenario, folder)
    payload = Payload.load(files.payload)
    engine, shown = odometry.create("continuous", payload), Progress().stage("", scenario.duration)
    with shown as stage, Recording([files.recording], payload) as recording:
        part = RecordingPart(recording, payload)
        for batch in part.batches(stage, Counter()):
            engine.feed(batch)
        opened = engine.result()
        closed = close_loops(opened, part.batches(stage, Counter()), payload).estimate
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
    files.recording.unlink()
    estimates = {"open": opened, "closed": closed}
    return {
        loops: normalized_pose_errors(e.trajectory, e.covariances, truth, in_flight(truth))
        for loops, e in estimates.items()
    }


def row(loops: str, head: str, flights: list[np.ndarray]) -> str:
    """A line of the table; every flight counts alike."""
    within = [[np.mean(np.abs(z) < bound, axis=0) for z in flights] for bound in BOUNDS]
    shares = np.mean(within, axis=1)
    cells = [
        ", ".join(f"{share:.0%}" for share in shares[:, group].mean(axis=1))
        for group in GROUPS.values()
    ]
    return tables.line([loops, head, str(len(flights)), *cells])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenes", nargs="+", default=list(SCENES))
    parser.add_argument("--heads", nargs="+", default=list(HEADS))
    parser.add_argument("--seeds", nargs="+", type=int, default=[0], help="of each scene and head")
    parser.add_argument("--duration", type=float, default=25.0, help="of each flight, in s")
    options = parser.parse_args()
    found: dict[tuple[str, str], list[np.ndarray]] = defaultdict(list)
    for head, scene, seed in product(options.heads, options.scenes, options.seeds):
        scenario = Scenario(scene=scene, head=head, duration=options.duration, seed=seed)
        with tempfile.TemporaryDirectory() as scratch:
            for loops, errors in normalized(scenario, Path(scratch) / "recording").items():
                found[loops, head].append(errors)
    print(tables.head(COLUMNS))
    for loops in ("open", "closed"):
        for head in options.heads:
            print(row(loops, head, found[loops, head]))
        print(row(loops, "all", [z for head in options.heads for z in found[loops, head]]))
