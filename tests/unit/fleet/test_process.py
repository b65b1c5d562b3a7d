# SPDX-License-Identifier: MIT OR Apache-2.0
"""Work in a process of its own: its answer, its death, and that of its parent."""

from __future__ import annotations

import subprocess
import sys
from threading import Thread

import psutil
import pytest

from bentwing.fleet import process
from bentwing.fleet.process import ProcessDiedError, Processes, run_process

# What the process does instead of a map, by the same main.
START = """
import sys, os, time, signal
sys.path[:] = {path!r}
from bentwing.fleet import child
def answer(order, progress):
    progress.note("half way")
    return dict(twice=2 * order["value"])
def die(order, progress):
    os.kill(os.getpid(), signal.SIGKILL)
def fail(order, progress):
    raise MemoryError("no room")
def wait(order, progress):
    print(os.getpid(), file=sys.stderr, flush=True)
    time.sleep(600)
child.WORK.update(answer=answer, die=die, fail=fail, wait=wait)
child.main()
"""
PARENT = """
import sys
sys.path[:] = {path!r}
from bentwing.fleet import process
process._START = {start!r}
process.run_process("wait", dict(), "w", process.Processes(lambda line: print(line, flush=True)))
"""


@pytest.fixture(autouse=True)
def start(monkeypatch):
    monkeypatch.setattr(process, "_START", START)


def test_a_process_answers_and_says_how_far_it_is():
    said = []
    found = run_process("answer", {"value": 21}, "north", Processes(said.append))
    assert found == {"twice": 42}
    assert said == ["north: half way"]


@pytest.mark.parametrize(
    ("work", "says"),
    [("die", "was killed, most probably because the memory"), ("fail", "MemoryError: no room")],
)
def test_a_process_that_dies_says_why(work, says):
    with pytest.raises(ProcessDiedError, match=says):
        run_process(work, {}, "north")


def test_an_interrupt_ends_the_processes():
    ended = []

    def work():
        with pytest.raises(ProcessDiedError, match="exit code 130"):
            run_process("wait", {}, "north", processes)
        ended.append(True)

    processes = Processes(lambda _: processes.end())
    thread = Thread(target=work)
    thread.start()
    thread.join(60)
    assert ended


def test_a_process_ends_with_its_parent_however_that_ends():
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT.format(path=sys.path, start=START)],
        stdout=subprocess.PIPE,
        text=True,
    )
    child = psutil.Process(int(parent.stdout.readline().split()[-1]))
    parent.kill()
    parent.wait()
    parent.stdout.close()
    assert child.wait(60) is None  # it is nobody's child any more, so nobody knows its code
    assert not child.is_running()
