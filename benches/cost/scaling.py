# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the estimator's time grows with points, surfels and threads, stage by stage.

One simulated recording is read once and estimated again and again: with a share of its points, with
other limits for its surfels, on one thread and on all cores. Prints a table in Markdown, medians
of several rounds, milliseconds per recorded second.
"""

from __future__ import annotations

import argparse
import os
import statistics
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benches.support import tables
from benches.support.cost import bentwing
from bentwing import odometry
from bentwing.odometry.continuous.settings import ContinuousSettings, SurfelSettings
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from bentwing.recording import Batch

STAGES = ("propagate", "surfels", "register")


@dataclass(frozen=True, slots=True)
class Variant:
    """What differs from the defaults: every n-th point, surfels per second, threads."""

    every: int = 1
    max_rate: float = SurfelSettings().max_rate
    threads: int = 1


def variants() -> list[Variant]:
    """One thing at a time."""
    rate = SurfelSettings().max_rate
    fewer = [Variant(every=n) for n in (1, 2, 4)]
    limits = [Variant(max_rate=factor * rate) for factor in (0.5, 2.0, 4.0)]
    return [*fewer, *limits, Variant(threads=os.cpu_count() or 1)]


def read(folder: Path) -> tuple[Payload, list[Batch], float]:
    """All batches of a recording, its payload, and its length in s."""
    payload = Payload.load(folder / "payload.yaml")
    with Recording(folder / "recording.bag", payload) as recording:
        return (
            payload,
            list(preprocess(recording.batches(), payload, Counter())),
            recording.duration,
        )


def thinned(batches: list[Batch], every: int) -> list[Batch]:
    """Every n-th return."""
    if every == 1:
        return batches
    return [b.where(slice(None, None, every)) if isinstance(b, LidarBatch) else b for b in batches]


def estimate(payload: Payload, batches: list[Batch], variant: Variant) -> dict[str, float]:
    """Seconds by stage, matches and surfels of a window on average."""
    surfels = SurfelSettings(max_rate=variant.max_rate)
    settings = ContinuousSettings(surfels=surfels)
    engine = odometry.create("continuous", payload, settings, variant.threads)
    started = time.perf_counter()
    for batch in batches:
        engine.feed(batch)
    result = engine.result()
    found = {stage: result.timings[stage] for stage in STAGES}
    found["whole"] = time.perf_counter() - started
    for name in ("n_surfels", "n_matches", "n_fixed_matches"):
        found[name] = statistics.fmean(getattr(window, name) for window in result.windows)
    return found


def row(variant: Variant, found: dict[str, float], n_points: float, seconds: float) -> str:
    """One line of the table."""
    times = [f"{1e3 * found[stage] / seconds:.1f}" for stage in (*STAGES, "whole")]
    matches = found["n_matches"] + found["n_fixed_matches"]
    sizes = [f"{n_points / seconds:.0f}", f"{found['n_surfels']:.0f}", f"{matches:.0f}"]
    return tables.line([*sizes, str(variant.threads), *times])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scene", nargs="?", default="courtyard")
    parser.add_argument("--head", default="hokuyo-spin")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--duration", type=float, default=60.0, help="of the flight, in s")
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        choices = ["--head", options.head, "--seed", options.seed, "--duration", options.duration]
        bentwing("simulate", options.scene, "-o", f"{folder}/r", *choices)
        payload, batches, seconds = read(Path(folder) / "r")
    found: dict[Variant, list[dict[str, float]]] = {variant: [] for variant in variants()}
    for _ in range(options.rounds):
        for variant, rounds in found.items():
            rounds.append(estimate(payload, thinned(batches, variant.every), variant))
    names = ("points/s", "surfels", "matches", "threads", *STAGES, "whole, ms per recorded s")
    print(tables.head(names))
    for variant, rounds in found.items():
        middle = {key: statistics.median(r[key] for r in rounds) for key in rounds[0]}
        kept = thinned(batches, variant.every)
        n_points = sum(len(b.times) for b in kept if isinstance(b, LidarBatch))
        print(row(variant, middle, n_points, seconds))
