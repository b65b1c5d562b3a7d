# SPDX-License-Identifier: MIT OR Apache-2.0
"""Run one engine on one recording in a process of its own, whatever becomes of it."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from benches.support.cost import Finished, python

if TYPE_CHECKING:
    from benches.peers.engines import Engine
    from benches.peers.feed import Feed

ROOT = Path(__file__).resolve().parents[2]
THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
MOST_WORDS = 80
"""Characters of a failure in the table; all of it is in the log."""


@dataclass(frozen=True, slots=True)
class Source:
    """A recording: its file, the description of its head if there is one, and its length in s."""

    name: str
    recording: Path
    payload: Path | None
    duration: float


def run(engine: Engine, source: Source, feed: Feed, out: Path, timeout: float) -> dict:
    """Cost, failure (None if there is none) and threads; poses or a run folder are left in `out`."""
    out.mkdir(parents=True)
    base = {
        "recording": source.name,
        "engine": engine.name,
        "duration": source.duration,
        "settings": engine.settings,
        "points": feed.head.kind,
        "score": {},
    }
    if (reason := unfit(engine, feed)) is not None:
        return {**base, "cost": None, "threads": "-", "failure": reason}
    log, paths = out / "log.txt", [str(ROOT), os.environ.get("PYTHONPATH", "")]
    finished = python(
        *_command(engine, source, feed, out),
        timeout=timeout,
        output=log,
        environment={
            **dict.fromkeys(THREADED, "1"),
            "PYTHONPATH": os.pathsep.join(filter(None, paths)),
        },
    )
    outcome = _outcome(out)
    return {
        **base,
        "cost": asdict(finished.cost),
        "threads": _threads(engine, outcome),
        "failure": failure_of(finished, outcome, log, timeout),
    }


def unfit(engine: Engine, feed: Feed) -> str | None:
    """Why an engine cannot take such scans at all."""
    if engine.needs_imu and feed.imu is None:
        return "needs an IMU"
    if engine.needs_rings and feed.head.rows == 1:
        return "needs rings"
    if engine.needs_raw_points and feed.head.kind == "stabilized":
        return "needs points as measured"
    return None


def failure_of(finished: Finished, outcome: dict, log: Path, timeout: float) -> str | None:
    """The end of a process in a few words."""
    if finished.timed_out:
        return f"timed out after {timeout:.0f} s"
    if outcome.get("failure"):
        return short(outcome["failure"])
    if finished.code < 0:
        return f"crashed: {signal.Signals(-finished.code).name}"
    if finished.code:
        said = [text for text in log.read_text(errors="replace").splitlines() if text.strip()]
        return short(f"crashed: {said[-1] if said else f'exit code {finished.code}'}")
    return None


def short(text: str) -> str:
    """One line that fits into a cell."""
    text = " ".join(text.replace("|", "/").split())
    return text if len(text) <= MOST_WORDS else f"{text[: MOST_WORDS - 1]}…"


def _command(engine: Engine, source: Source, feed: Feed, out: Path) -> list[str | Path]:
    if engine.adapter is not None:
        return ["-m", "benches.peers.worker", engine.name, feed.folder, out]
    payload = [] if source.payload is None else ["--payload", source.payload]
    asked = [source.recording, *payload, "-o", out / "run", "--quiet", "--threads", "1"]
    return ["-m", "bentwing", "map", *asked]


def _outcome(out: Path) -> dict:
    path = out / "outcome.json"
    return json.loads(path.read_text()) if path.exists() else {}


def _threads(engine: Engine, outcome: dict) -> str:
    if engine.threads is not None:
        return str(engine.threads)
    return f"{outcome['threads']}*" if outcome.get("threads") else "?"
