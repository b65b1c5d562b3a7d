# SPDX-License-Identifier: MIT OR Apache-2.0
"""One piece of work in a process of its own, so that its memory returns and its crash is its own.

The process reads its work from a line and ends when that pipe closes: whoever kills the parent, by
whatever means, leaves nothing behind that still writes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections import deque
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, TypeVar

from bentwing.base.plain import plain

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

_Result = TypeVar("_Result")
# The same modules as here, and not those that happen to lie where the command was started.
_START = "import sys; sys.path[:] = {path!r}; from bentwing.fleet.child import main; main()"
_BLAS_THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
_KILLED = -9
BUSY = "busy"
"""In an answer: another process does the same work, as one whose worker was given up too early."""
_PAUSE = 5.0  # s before looking again whether that has ended


class ProcessDiedError(RuntimeError):
    """The process ended without an answer: killed, out of memory or disk, or by a bug."""


class Processes:
    """Those that are running, so that an interrupt can end them, and what they say meanwhile.

    Parameters
    ----------
    say : called with each line of each
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self.say = say
        self._running: set[subprocess.Popen[str]] = set()
        self._is_over = False

    def add(self, process: subprocess.Popen[str]) -> None:
        """Know of a process from now on."""
        self._running.add(process)
        if self._is_over:  # started while the others were being ended
            process.terminate()

    def remove(self, process: subprocess.Popen[str]) -> None:
        """Know that it has ended."""
        self._running.discard(process)

    def end(self) -> None:
        """Interrupt all; each keeps what it has."""
        self._is_over = True
        for process in list(self._running):
            process.terminate()


def run_process(
    work: str, argument: Mapping[str, Any], name: str, processes: Processes | None = None
) -> dict[str, Any]:
    """Do a piece of work in a process and return its answer.

    Parameters
    ----------
    work : one of `bentwing.fleet.child.WORK`
    argument : for it, what `plain` can make JSON of
    name : of what it is about, for what it says
    processes : that are running in this process

    Raises
    ------
    ProcessDiedError
    """
    with TemporaryDirectory(prefix="bentwing-") as folder:
        answer = Path(folder) / "answer.json"
        order = {"work": work, "answer": str(answer), **plain(dict(argument))}
        code, last = _run(json.dumps(order), name, processes)
        if code == 0 and answer.is_file():
            found: dict[str, Any] = json.loads(answer.read_text(encoding="utf-8"))
            return found
    raise ProcessDiedError(_why(code, last))


def run_unless_done(
    work: str,
    argument: Mapping[str, Any],
    name: str,
    processes: Processes | None,
    done: Callable[[], _Result | None],
) -> _Result | dict[str, Any]:
    """Return what is done already, or the answer of a process; wait for a twin that does the same.

    Parameters
    ----------
    done : returns the result if it is there

    Raises
    ------
    ProcessDiedError
    """
    while (result := done()) is None:
        answer = run_process(work, argument, name, processes)
        if BUSY not in answer:
            return answer
        time.sleep(_PAUSE)
    return result


def _run(order: str, name: str, processes: Processes | None) -> tuple[int, str]:
    """Return the exit code and the last line that was said."""
    environment = {**dict.fromkeys(_BLAS_THREADS, "1"), **os.environ}
    with subprocess.Popen(
        [sys.executable, "-c", _START.format(path=sys.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=environment,
        start_new_session=True,  # Ctrl-C comes from us, not from the terminal
    ) as process:
        if processes is not None:
            processes.add(process)
        try:
            assert process.stdin is not None  # it is a pipe
            with suppress(BrokenPipeError):
                process.stdin.write(order + "\n")
                process.stdin.flush()
            last: deque[str] = deque(maxlen=1)
            for line in process.stderr or ():
                if line.strip():
                    last.append(line.strip())
                    if processes is not None:
                        processes.say(f"{name}: {line.strip()}")
            return process.wait(), "".join(last)
        except BaseException:
            process.kill()
            raise
        finally:
            if processes is not None:
                processes.remove(process)


def _why(code: int, last: str) -> str:
    if code == _KILLED:
        return "the process was killed, most probably because the memory did not suffice"
    return f"the process ended with exit code {code}{': ' if last else ''}{last}"
