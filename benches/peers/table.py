# SPDX-License-Identifier: MIT OR Apache-2.0
"""Results as Markdown."""

from __future__ import annotations

import statistics

import numpy as np

from benches.support import tables
from benches.support.tables import given

COLUMNS = (
    "recording", "engine", "ATE", "ATE in flight", "rotation", "drift over 10 m (horizontal, vertical)",
    "map, best possible = 1", "CPU per s recorded", "wall per s recorded", "peak memory", "threads",
)  # fmt: skip
NOTES = """\
- ATE and rotation after an SE(3) alignment, root mean square at the engine's own poses; "lost" is
  worse than standing still, or fewer poses than for half the flight.
- Map: spread of the points across the true surfaces. bentwing's is the map that it writes; for the
  others the same points are placed by their poses, with the gyro's attitude and a cubic between
  these, nominal mounts and the true latency.
- Given to the others: points within the payload's ranges and without its self-hits, nominal mounts
  as bentwing gets them, and the lidar's clock without its true latency, which bentwing estimates.
  Fixed 3D lidars: sweeps as recorded, with time and ring of each point, in the lidar frame.
  Motor-turned ones: points put into the IMU frame by the encoder, half seconds (five sweeps of
  10 Hz) joined into one scan. Spun or nodding 2D ones: lines de-rotated by the gyro (less its bias
  at rest) into one cloud per half turn, in a frame that does not turn; inertial samples likewise.
- Cost is that of the whole process: of bentwing's with reading the recording, writing the map and
  the report; of the others' with reading prepared arrays. Threads as asked for, or, marked *,
  those that were left at the end of an engine that cannot be told.
"""


def row(result: dict) -> str:
    """One engine on one simulated recording."""
    found, failure = result["score"], result["failure"]
    drift = ", ".join(given(found.get(name), 1e3, "mm/m") for name in ("horizontal", "vertical"))
    errors = [
        given(found.get("ate"), 100, "cm"),
        given(found.get("ate_flight"), 100, "cm"),
        given(found.get("rotation"), np.degrees(1.0), "°"),
        drift,
        given(found.get("map_ratio"), 1, ""),
    ]
    if failure:
        errors = [failure, "-", "-", "-", "-"]
    return tables.line([result["recording"], result["engine"], *errors, *costs(result)])


def costs(result: dict) -> list[str]:
    """What it took, for as long as it ran."""
    cost, duration = result["cost"], result["duration"]
    if cost is None:
        return ["-"] * 4
    return [
        f"{cost['cpu'] / duration:.2f} s",
        f"{cost['seconds'] / duration:.2f} s",
        f"{cost['megabytes']:.0f} MB",
        result["threads"],
    ]


def stamps_row(result: dict) -> str:
    """What is left of the assumed stamps: the shift that fits the truth best, and what it gains."""
    found = result["score"]
    names = ("clock_left", "ate_flight", "ate_flight_shifted")
    cells = [
        given(found.get(n), f, u)
        for n, f, u in zip(names, (1e3, 100, 100), ("ms", "cm", "cm"), strict=True)
    ]
    return tables.line([result["recording"], result["engine"], *cells])


STAMPS_COLUMNS = ("recording", "engine", "best shift of the clock", "ATE in flight", "with it")


def middle(results: list[dict]) -> dict:
    """Several runs of one engine on one recording, of which not all say the same each time.

    The middle of what they cost, and the one with the middle error in flight, or the first that
    failed where most did.
    """
    good = sorted((r for r in results if not r["failure"]), key=lambda r: r["score"]["ate_flight"])
    failed = [r for r in results if r["failure"]]
    chosen = failed[0] if len(failed) > len(good) else good[(len(good) - 1) // 2]
    costed = [r["cost"] for r in results if r["cost"] is not None]
    if not costed:
        return chosen
    keys = costed[0]
    return {**chosen, "cost": {key: statistics.median(c[key] for c in costed) for key in keys}}
