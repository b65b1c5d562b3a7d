# SPDX-License-Identifier: MIT OR Apache-2.0
"""What mapping an hour of recording takes of processor, memory, disk and network, for each head.

Two recordings of different lengths are simulated and mapped on one thread, each in a process of its own.
What an hour takes is their difference, so what every run takes once is not counted; memory is that of the
longer one. Prints a table in Markdown.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import dataclass
from pathlib import Path

from benches.support import tables
from benches.support.cost import bentwing

HEADS = ("hokuyo-spin", "vlp16-motor", "os1-64")
COLUMNS = ("head", "scene", "measured", "processor time", "peak memory", "recording", "run folder")


@dataclass(frozen=True, slots=True)
class Taken:
    """Of one recording: s of processor, MB of memory, bytes read and written."""

    cpu: float
    megabytes: float
    read: int
    written: int


def measure(head: str, scene: str, seconds: float, seed: int) -> Taken:
    """Simulate and map a recording."""
    with tempfile.TemporaryDirectory() as folder:
        made, out = Path(folder) / "recording", Path(folder) / "run"
        bentwing("simulate", scene, "-o", made, "--head", head, "--duration", seconds,
                 "--flight-seed", seed, "-q")  # fmt: skip
        recording, payload = made / "recording.bag", made / "payload.yaml"
        cost = bentwing("map", recording, "-p", payload, "-o", out, "--threads", 1, "-q")
        written = sum(file.stat().st_size for file in out.rglob("*") if file.is_file())
        return Taken(cost.cpu, cost.megabytes, recording.stat().st_size, written)


def main() -> None:
    """Print a row for each head."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("heads", nargs="*", default=list(HEADS))
    parser.add_argument("--scene", default="courtyard")
    parser.add_argument("--lengths", type=float, nargs=2, default=(25.0, 50.0), metavar="SECONDS")
    parser.add_argument("--seed", type=int, default=900)
    options = parser.parse_args()
    print(tables.head(COLUMNS))
    for head in options.heads:
        short, long = (measure(head, options.scene, s, options.seed) for s in options.lengths)
        hours = (options.lengths[1] - options.lengths[0]) / 3600
        cells = (
            head,
            options.scene,
            " and ".join(f"{s:g} s" for s in options.lengths),
            f"{(long.cpu - short.cpu) / hours / 3600:.2f} h",
            f"{long.megabytes / 1e3:.2f} GB",
            f"{(long.read - short.read) / hours / 1e9:.1f} GB",
            f"{(long.written - short.written) / hours / 1e9:.1f} GB",
        )
        print(tables.line(cells), flush=True)
