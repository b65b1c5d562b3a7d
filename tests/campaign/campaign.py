# SPDX-License-Identifier: MIT OR Apache-2.0
"""Run commands with faults drawn by seeds, and judge how they end.

A seed decides the kind of fault and all that is random in it; the moments of stops alone depend on the
machine. `run` of a seed is what `make campaign` does a thousand times.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import tempfile
import threading
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import BentwingError
from bentwing.base.run_record import finished_record
from campaign.faults import KINDS, RECORDINGS, Attempt, Healthy
from campaign.watched import Ended, run

if TYPE_CHECKING:
    from collections.abc import Iterator

MOST_MB = 500  # of a command that refuses its input
MOST_MB_OF_OTHERS = 2000
SLACK = 30.0  # s beyond what the healthy command takes
SEARCH = 120.0  # s, more than the search for the set-up of a 2D head takes, which doubts begin
MAPPED = ("trajectory.txt", "map.laz")
ORDINARY = frozenset({0, 1, 2, 3, 4, 130})
_IS_THERE = "exists already"  # of a file or a recording that a command has written
_SIGNS = (
    "Traceback (most",
    "panicked at",
    "PanicException",
    "this is a bug",
    "memory allocation of",
)


@dataclass(frozen=True, slots=True)
class Finding:
    """What is wrong with how a command ended."""

    seed: int
    kind: str
    what: str
    command: str
    said: str


@dataclass(frozen=True, slots=True)
class Outcome:
    """How the command of a seed ended.

    Attributes
    ----------
    findings : empty where all is as it must be
    """

    kind: str
    ended: Ended
    findings: tuple[Finding, ...]


@dataclass(frozen=True, slots=True)
class Ground:
    """What the faults of a campaign are made of, and what the undisturbed command takes."""

    healthy: Healthy
    seconds: float

    @classmethod
    def made(cls, folder: Path) -> Ground:
        """Simulate a recording and map it."""
        for name in RECORDINGS:
            form = Path(name).suffix[1:]
            command = ["simulate", "office", "--duration", "22", "--format", form, "-q"]
            _require(run([*command, "-o", folder / form]))
            if form != "bag":
                found = next((folder / form).rglob(f"*.{form}"))
                shutil.move(found, folder / "bag" / name)
        return cls.of(folder / "bag", folder / "run")

    @classmethod
    def of(cls, recordings: Path, run_folder: Path) -> Ground:
        """Map the bag in a folder of recordings."""
        healthy = Healthy(recordings, run_folder)
        payload = ["-p", healthy.payload, "--duration", "6", "-q"]
        mapped = run(["map", healthy.folder / RECORDINGS[0], *payload, "-o", healthy.run])
        _require(mapped)
        return cls(healthy, mapped.seconds)


def _require(ended: Ended) -> None:
    assert ended.code == 0, ended.said


def tried(seed: int, ground: Ground, kinds: tuple[str, ...] = tuple(KINDS)) -> Outcome:
    """Run the command of a seed, and judge it."""
    draw = random.Random(seed)
    kind = kinds[seed % len(kinds)]
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as stack:
        folder = Path(temporary)
        attempt = KINDS[kind](ground.healthy, folder, draw)
        if attempt.cleanup is not None:
            stack.callback(attempt.cleanup)
        found = list(_problems(attempt, ground, kind, folder))
        ended = found.pop(0)
        assert isinstance(ended, Ended)
        command = " ".join(_shown(part) for part in attempt.command)
        findings = [
            Finding(seed, kind, str(what), command[:500], ended.said[-500:]) for what in found
        ]
    return Outcome(kind, ended, tuple(findings))


def _shown(part: object) -> str:
    return os.fspath(part) if isinstance(part, Path) else str(part)[:100]


def _problems(attempt: Attempt, ground: Ground, kind: str, folder: Path) -> Iterator[Ended | str]:
    """Yield how the command ended, then what is wrong with that."""
    longest = ground.seconds * 2 + SLACK + SEARCH
    others: list[Ended] = []
    second = threading.Thread(target=lambda: others.append(run(attempt.second or [])))
    if attempt.second is not None:
        second.start()
    ended = run(
        attempt.command,
        meanwhile=attempt.meanwhile,
        environment={"PYTHONFAULTHANDLER": "1"},
        limits=attempt.limits,
        longest=longest,
    )
    if attempt.second is not None:
        second.join()
    yield ended
    for one in [ended, *others]:
        yield from _of_end(one, may_be_killed=kind == "kill")
    if attempt.second is not None and {one.code for one in [ended, *others]} != {0, 2}:
        yield f"two writers ended with {ended.code} and {[one.code for one in others]}"
    if attempt.out is not None:
        yield from _of_result(attempt.out, ground, kind, ended)
    if attempt.again is not None:
        yield from _of_again(attempt, ground, folder, longest, ended)


def _of_again(
    attempt: Attempt, ground: Ground, folder: Path, longest: float, ended: Ended
) -> Iterator[str]:
    """What is wrong with what is there once the command was run again."""
    if attempt.usual is not None and ended.code == 0:  # it was done before it was stopped
        yield from attempt.usual.differences(folder)
        return
    if attempt.before_again is not None:
        attempt.before_again()
    again = run(attempt.again or [], longest=longest)
    # What was done when it was stopped is not written over, and has to be whole.
    is_whole = attempt.usual is not None and _IS_THERE in again.said
    if again.code != 0 and not is_whole:
        yield f"run again it ends with {again.code}: {again.said[-300:]}"
    elif attempt.usual is not None:
        yield from (f"run again: {what}" for what in attempt.usual.differences(folder))
    elif attempt.command[0] == "map" and attempt.out is not None:
        yield from _other_bytes(attempt.out, ground, "run again")


def _of_end(ended: Ended, *, may_be_killed: bool) -> Iterator[str]:
    if ended.code is None:
        yield f"hangs: not done after {ended.seconds:.0f} s"
    elif ended.code not in ORDINARY and not (may_be_killed and ended.code in {-9, -15, -2}):
        yield f"exit code {ended.code}"
    yield from (f"says {sign!r}" for sign in _SIGNS if sign in ended.said)
    if ended.said.count("bentwing: error:") > 1:
        yield "more than one sentence of error"
    if "\x1b" in ended.said:
        yield "an escape reaches the terminal"
    most = MOST_MB if ended.code in {2, 3} else MOST_MB_OF_OTHERS
    if ended.peak_mb > most:
        yield f"{ended.peak_mb:.0f} MB"


def _of_result(out: Path, ground: Ground, kind: str, ended: Ended) -> Iterator[str]:
    """What is wrong with the folder of a result: it must not say that it is whole where it is not."""
    record = _record(out)
    if record is None or not record.get("complete"):
        if ended.code == 0 and (out / "run.json").exists():
            yield "exit code 0 without a complete run"
        return
    try:
        finished_record(out)
    except BentwingError as error:
        yield f"complete, but {error}"
    if kind in {"change", "disk", "writers"}:
        yield from _other_bytes(out, ground, "complete")
    if kind == "kill":
        return
    healthy = _record(ground.healthy.run) or {}
    n, usual = (r.get("counts", {}).get("map.written", 0) for r in (record, healthy))
    if n < 0.9 * usual and not record.get("warnings"):
        yield f"complete without a warning, with {n} points instead of {usual}"


def _other_bytes(out: Path, ground: Ground, when: str) -> Iterator[str]:
    for name in MAPPED:
        with suppress(OSError):
            if (out / name).read_bytes() == (ground.healthy.run / name).read_bytes():
                continue
        yield f"{when}: {name} is another"


def _record(folder: Path) -> dict[str, Any] | None:
    try:
        found = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None
