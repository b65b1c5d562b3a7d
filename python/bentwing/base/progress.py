# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far a long command is: a bar on a terminal, a few plain lines in a log, or nothing."""

from __future__ import annotations

import sys
import time
from contextlib import contextmanager
from typing import IO, TYPE_CHECKING, Protocol

from bentwing.base.arguments import instance
from bentwing.base.printable import printable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

LINE_INTERVAL = 5.0  # s between plain lines of one stage
_LINE_SHARE = 0.1  # and not before this much more is done


class Stage(Protocol):
    """A running stage."""

    def advance(self, amount: float) -> None:
        """Say that `amount` more of the stage's total is done."""


class Progress:
    """Says nothing; the base of those that do.

    `with progress.stage("map", total=120.0, unit="s") as stage: stage.advance(0.5)`
    """

    @contextmanager
    def stage(self, name: str, total: float | None = None, unit: str = "s") -> Iterator[Stage]:
        """Open a stage.

        Parameters
        ----------
        name : what is being done, as a user would say it
        total : the amount that is everything, None if unknown
        unit : of the amounts; "s" means seconds of the recording
        """
        del name, total, unit
        yield _Silent()

    def note(self, text: str) -> None:
        """Say something that is worth knowing before a stage begins."""
        del text


class LineProgress(Progress):
    """Plain lines, for logs and pipes: at most one every few seconds, and one at the end."""

    def __init__(
        self,
        stream: IO[str] | None = None,
        clock: Callable[[], float] = time.monotonic,
        interval: float = LINE_INTERVAL,
    ) -> None:
        self._stream = stream
        self._clock = clock
        self._interval = interval

    @contextmanager
    def stage(self, name: str, total: float | None = None, unit: str = "s") -> Iterator[Stage]:
        """Open a stage; see `Progress.stage`."""
        lines = _Lines(self._print, name, total, unit, self._clock, self._interval)
        yield lines
        lines.finish()

    def note(self, text: str) -> None:
        """Print a line."""
        self._print(text)

    def _print(self, line: str) -> None:
        print(printable(line), file=self._stream or sys.stderr, flush=True)


class BarProgress(Progress):
    """One bar per stage with rate and remaining time."""

    @contextmanager
    def stage(self, name: str, total: float | None = None, unit: str = "s") -> Iterator[Stage]:
        """Open a stage; see `Progress.stage`."""
        from rich.console import Console  # slow to import, and only needed on a terminal
        from rich.progress import (
            BarColumn,
            TaskProgressColumn,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )
        from rich.progress import Progress as RichProgress

        columns = (
            TextColumn("{task.description:<12}"),
            BarColumn(),
            TaskProgressColumn(),
            TextColumn("{task.fields[rate]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
        )
        with RichProgress(*columns, console=Console(stderr=True)) as bars:
            task = bars.add_task(name, total=total, rate="")
            started, done = time.monotonic(), 0.0

            class _Bar:
                def advance(self, amount: float) -> None:
                    nonlocal done
                    done += amount
                    text = _rate(done, time.monotonic() - started, unit)
                    bars.update(task, advance=amount, rate=text)

            yield _Bar()
            bars.update(task, total=done, completed=done)

    def note(self, text: str) -> None:
        """Print a line between the bars."""
        print(printable(text), file=sys.stderr, flush=True)


def as_progress(value: Progress | None) -> Progress:
    """Return the progress, None standing for one that says nothing.

    Raises
    ------
    TypeError
        If it is of another type.
    """
    if value is None:
        return Progress()
    return instance(
        "progress", value, Progress, "give a subclass with `stage` and `note`, or leave it out"
    )


def create_progress(*, quiet: bool = False) -> Progress:
    """Choose the progress that fits where standard error goes."""
    if quiet:
        return Progress()
    return BarProgress() if sys.stderr.isatty() else LineProgress()


class _Silent:
    def advance(self, amount: float) -> None:
        del amount


class _Lines:
    def __init__(  # noqa: PLR0917 - private, called once
        self,
        write: Callable[[str], None],
        name: str,
        total: float | None,
        unit: str,
        clock: Callable[[], float],
        interval: float,
    ) -> None:
        self._write, self._name, self._total, self._unit = write, name, total, unit
        self._clock, self._interval = clock, interval
        self._done = 0.0
        self._started = self._last = clock()
        self._last_share = 0.0

    def advance(self, amount: float) -> None:
        self._done += amount
        now = self._clock()
        share = self._done / self._total if self._total else 0.0
        due = now - self._last >= self._interval
        if due and (not self._total or share >= self._last_share + _LINE_SHARE):
            self._last, self._last_share = now, share
            self._write(self._line(now - self._started))

    def finish(self) -> None:
        elapsed = self._clock() - self._started
        rate = _rate(self._done, elapsed, self._unit)
        self._write(f"{self._name}: done in {_duration(elapsed)}{', ' + rate if rate else ''}")

    def _line(self, elapsed: float) -> str:
        rate = _rate(self._done, elapsed, self._unit)
        if not self._total:
            return f"{self._name}: {self._done:,.0f} {self._unit}, {rate}"
        share = min(self._done / self._total, 1.0)
        left = _duration(elapsed * (1 - share) / share)
        return f"{self._name}: {100 * share:.0f} %, {rate}, {left} left"


def _rate(done: float, elapsed: float, unit: str) -> str:
    if elapsed <= 0 or done <= 0:
        return ""
    # seconds of recording per second are what users know as the real-time factor
    return f"{done / elapsed:.1f} x real time" if unit == "s" else f"{done / elapsed:,.0f} {unit}/s"


def _duration(seconds: float) -> str:
    whole = round(seconds)
    return f"{whole // 60}:{whole % 60:02d} min" if whole >= 60 else f"{seconds:.1f} s"
