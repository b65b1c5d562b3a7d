# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a command costs: run it in a process of its own and ask the system for its usage."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Cost:
    """Wall time and processor time in s and peak resident memory in MB of one command."""

    seconds: float
    cpu: float
    megabytes: float


@dataclass(frozen=True, slots=True)
class Finished:
    """How a command ended: exit code (negative: the signal that ended it), and whether in time."""

    cost: Cost
    code: int
    timed_out: bool = False


def python(
    *arguments: str | Path,
    timeout: float | None = None,
    output: Path | None = None,
    environment: Mapping[str, str] | None = None,
) -> Finished:
    """Run this interpreter on arguments.

    A small process in between starts and measures it: the peak memory of a process counts from
    before its start, when it still was a copy of the one that started it.

    Parameters
    ----------
    arguments : as after `python`
    timeout : s of wall time, then the process is killed
    output : file for what it prints; default: stderr, to keep stdout for tables
    environment : added to ours
    """
    order = {"command": [sys.executable, *map(str, arguments)], "timeout": timeout}
    order["output"] = None if output is None else str(output)
    said = subprocess.run(
        [sys.executable, "-I", "-S", __file__],
        input=json.dumps(order),
        env={**os.environ, **(environment or {})},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout
    found = json.loads(said)
    return Finished(Cost(*found["cost"]), found["code"], found["timed_out"])


def bentwing(*arguments: object) -> Cost:
    """Run one command, which has to succeed; its own output goes to stderr."""
    words = [str(argument) for argument in arguments]
    finished = python("-m", "bentwing", *words)
    if finished.code:
        sys.exit(f"bentwing {' '.join(words)}: exit code {finished.code}")
    return finished.cost


def measure(order: dict) -> dict:
    """Carry out what `python` asks for."""
    start = time.perf_counter()
    command, expired = order["command"], threading.Event()
    redirections = _redirections(order["output"])
    child = os.posix_spawn(command[0], command, os.environ, file_actions=redirections)

    def kill() -> None:
        expired.set()
        os.kill(child, signal.SIGKILL)

    timer = threading.Timer(order["timeout"] or 0.0, kill)
    if order["timeout"] is not None:
        timer.start()
    _, status, usage = os.wait4(child, 0)
    timer.cancel()
    seconds, cpu = time.perf_counter() - start, usage.ru_utime + usage.ru_stime
    return {
        "cost": [seconds, cpu, usage.ru_maxrss / 1024],
        "code": os.waitstatus_to_exitcode(status),
        "timed_out": expired.is_set(),
    }


def _redirections(output: str | None) -> list[tuple]:
    if output is None:
        return [(os.POSIX_SPAWN_DUP2, 2, 1)]
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC
    return [(os.POSIX_SPAWN_OPEN, 1, output, flags, 0o644), (os.POSIX_SPAWN_DUP2, 1, 2)]


if __name__ == "__main__":
    print(json.dumps(measure(json.load(sys.stdin))))
