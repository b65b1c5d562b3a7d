# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where work runs: side by side on this machine, or wherever a cluster has workers."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from bentwing.fleet.process import ProcessDiedError, Processes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from types import TracebackType

    from typing_extensions import Self


@dataclass(frozen=True, slots=True)
class Job:
    """A piece of work.

    Attributes
    ----------
    key : names it by its content: work of the same key has the same result
    function : called with `task`, a number of threads, and where work runs in this process with the
        processes that do
    megabytes : of memory that it takes
    """

    key: str
    function: Callable[..., Any]
    task: Any
    megabytes: float


class Pool(Protocol):
    """Runs jobs."""

    def results(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
        """Yield each job with its result, or with the exception that it ended in, as they end."""


class LocalPool:
    """Context manager: jobs side by side on this machine, each in a process of its own.

    Parameters
    ----------
    n : jobs at the same time
    threads : of each; default: the cores, shared
    say : called with each line that one says
    """

    def __init__(self, n: int, threads: int | None, say: Callable[[str], None]) -> None:
        self._n, self._threads = n, threads
        self._processes = Processes(say)
        self._executor = ThreadPoolExecutor(n)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is not None:
            self._processes.end()
        self._executor.shutdown(cancel_futures=True)

    def results(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
        """Yield each job with its result or exception; those whose process died after one more try.

        They are tried when nothing else runs, so that they have all of the memory.
        """
        threads = threads_among(self._n, len(jobs), self._threads)
        futures = {
            self._executor.submit(job.function, job.task, threads, self._processes): job
            for job in jobs
        }
        died = []
        for future in as_completed(futures):
            error = future.exception()
            if isinstance(error, ProcessDiedError):
                died.append(futures[future])
            else:
                yield futures[future], error or future.result()
        for job in died:
            future = self._executor.submit(job.function, job.task, threads, self._processes)
            yield job, future.exception() or future.result()


def threads_among(n_workers: int, n_jobs: int, threads: int | None) -> int:
    """Return the threads of each job on this machine: those asked for, or a share of the cores."""
    return threads or max(1, (os.cpu_count() or 1) // max(1, min(n_workers, n_jobs)))
