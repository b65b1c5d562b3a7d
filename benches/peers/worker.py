# SPDX-License-Identifier: MIT OR Apache-2.0
"""One engine on one feed, in a process of its own: `python -m benches.peers.worker ENGINE FEED OUT`."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path

import numpy as np

from benches.peers.engines import ENGINES
from benches.peers.feed import open_feed
from bentwing.base import geometry


def main() -> None:
    """Write poses.npz, and outcome.json with the reason where there are none."""
    name, feed, out = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    engine = ENGINES[name]
    try:
        adapter = importlib.import_module(f"benches.peers.adapters.{engine.adapter}")
    except ModuleNotFoundError as error:
        finish(out, f"{error.name} is not installed")
        return
    try:
        found = list(adapter.run(open_feed(feed), engine))
    except Exception as error:
        finish(out, f"crashed: {type(error).__name__}: {error}")
        raise
    stamps = np.array([stamp for stamp, _ in found], np.int64)
    poses = np.array([pose for _, pose in found]).reshape(-1, 4, 4)
    quats = geometry.from_matrices(poses[:, :3, :3])
    np.savez(out / "poses.npz", stamps_ns=stamps, positions=poses[:, :3, 3], quats_xyzw=quats)
    finish(out, None)


def finish(out: Path, failure: str | None) -> None:
    """Say how it went; the threads that are left are those of the engine's pools and this one."""
    tasks = Path("/proc/self/task")
    threads = len(list(tasks.iterdir())) if tasks.exists() else None
    (out / "outcome.json").write_text(json.dumps({"failure": failure, "threads": threads}))


if __name__ == "__main__":
    main()
