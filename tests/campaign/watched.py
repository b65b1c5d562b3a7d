# SPDX-License-Identifier: MIT OR Apache-2.0
"""Run the command in a process of its own, and say how it ended and what it took."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import threading
import time
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

LONGEST = 600.0  # s; what is not done by then hangs


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended.

    Attributes
    ----------
    code : exit code, negative for the signal that ended it, None where it had to be killed
    said : what it wrote to both outputs
    seconds : of wall time
    peak_mb : most memory that it held
    """

    code: int | None
    said: str
    seconds: float
    peak_mb: float


def run(
    arguments: Sequence[str | bytes | Path],
    *,
    meanwhile: Callable[[subprocess.Popen[bytes]], None] | None = None,
    environment: dict[str, str] | None = None,
    limits: Sequence[tuple[str, int]] = (),
    longest: float = LONGEST,
) -> Ended:
    """Run `bentwing` with these arguments.

    Parameters
    ----------
    meanwhile : is called once the process has begun, to disturb it
    environment : variables besides those of this process
    limits : resources that it may have, by the names of the module `resource`
    """
    # An odd value of an option is the name of a file as well: it must not come into the project.
    with tempfile.TemporaryFile() as said, tempfile.TemporaryDirectory() as nowhere:
        started = time.monotonic()
        process = subprocess.Popen(
            [sys.executable, "-m", "bentwing", *arguments],
            cwd=nowhere,
            stdin=subprocess.DEVNULL,
            stdout=said,
            stderr=said,
            env={**os.environ, **(environment or {})},
            start_new_session=True,
            preexec_fn=partial(_limit, limits) if limits else None,
        )
        disturber = threading.Thread(target=meanwhile or _nothing, args=(process,))
        disturber.start()
        code, peak = _wait(process, started + longest)
        disturber.join()
        said.seek(0)
        text = said.read().decode("utf-8", "replace")
    return Ended(code, text, time.monotonic() - started, peak)


def _nothing(process: subprocess.Popen[bytes]) -> None:
    del process


def _limit(limits: Sequence[tuple[str, int]]) -> None:
    import resource

    for name, most in limits:
        resource.setrlimit(getattr(resource, name), (most, most))


def _wait(process: subprocess.Popen[bytes], until: float) -> tuple[int | None, float]:
    """Return the exit code of a process and its peak in MB; kill it at the end of its time."""
    peak = 0.0
    while time.monotonic() < until:
        peak = max(peak, _peak_mb(process.pid))
        if (code := process.poll()) is not None:
            return code, peak
        time.sleep(0.02)
    process.kill()
    process.wait()
    return None, peak


def _peak_mb(pid: int) -> float:
    """Return the most memory that a process has held so far; what `wait4` says counts its parent's."""
    try:
        status = Path(f"/proc/{pid}/status").read_text(encoding="utf-8")
    except OSError:
        return 0.0
    peaks = [line.split()[1] for line in status.splitlines() if line.startswith("VmHWM:")]
    return float(peaks[0]) / 1024 if peaks else 0.0
