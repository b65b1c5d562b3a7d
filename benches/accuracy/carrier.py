# SPDX-License-Identifier: MIT OR Apache-2.0
"""Proposed `self_hits` on simulated flights: what of the carrier they hold, and false ones without it.

The reference is the box of the simulated payload, in flight: a little of what is in it is not the
carrier. Without a carrier the recording is read with that box.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import get_args

import numpy as np

from benches.support import tables
from bentwing.calibrate.carrier import CarrierWatch
from bentwing.evaluate.simulated import Truth
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess
from bentwing.recording.preprocess.self_hits import outside_boxes
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.names import HeadName

COLUMNS = (
    "head", "scene", "seed", "boxes", "returns in the payload's box", "of these found",
    "others found", "boxes without carrier", "s per minute",
)  # fmt: skip


def watched(files, payload: Payload) -> tuple[tuple, list[LidarBatch], float]:
    """Proposed boxes, the batches they are from, and the seconds it took."""
    watch, seconds, lidar = CarrierWatch(payload), 0.0, []
    with Recording(files.recording, payload) as recording:
        for batch in preprocess(recording.batches(), payload, Counter()):
            begin = time.process_time()
            watch.add(batch)
            seconds += time.process_time() - begin
            if isinstance(batch, LidarBatch):
                lidar.append(batch.where(slice(None, None, 5)))
    begin = time.process_time()
    boxes = watch.boxes()
    return boxes, lidar, seconds + time.process_time() - begin


def row_of(scenario: Scenario, folder: Path) -> str:
    """One row of the table."""
    files = simulate(scenario, folder)
    payload = Payload.load(files.payload)
    bare = payload.model_copy(update={"self_hits": ()})
    boxes, lidar, seconds = watched(files, bare)
    without, *_ = watched(files, payload)
    first, last = Truth(folder).flight
    points = np.concatenate([b.points[(b.times > first) & (b.times < last)] for b in lidar])
    own, found = (~outside_boxes(points, one) for one in (payload.self_hits, boxes))
    files.recording.unlink()
    cells = [
        scenario.head, scenario.scene, str(scenario.seed), str(len(boxes)), f"{own.mean():.2%}",
        f"{(found & own).sum() / max(1, own.sum()):.0%}", f"{(found & ~own).mean():.2%}",
        str(len(without)), f"{60 * seconds / scenario.duration:.2f}",
    ]  # fmt: skip
    return tables.line(cells)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--heads", nargs="+", default=get_args(HeadName))
    parser.add_argument("--scenes", nargs="+", default=["courtyard", "office", "forest", "mine"])
    parser.add_argument("--seed", type=int, default=101, help="of the first flight; then one more")
    parser.add_argument("--duration", type=float, default=26.0, help="s")
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    seed = options.seed
    with tempfile.TemporaryDirectory() as scratch:
        for head in options.heads:
            for scene in options.scenes:
                scenario = Scenario(
                    scene=scene, head=head, duration=options.duration, seed=seed
                )  # fmt: skip
                print(row_of(scenario, Path(scratch) / f"{head}-{scene}"), flush=True)
                seed += 1
