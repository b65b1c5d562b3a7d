# SPDX-License-Identifier: MIT OR Apache-2.0
"""Pools that are opened when there is something to do, as large as that needs."""

from __future__ import annotations

from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bentwing.fleet.cluster import ClusterPool, address_of, connected, started
from bentwing.fleet.memory import available_mb, n_side_by_side
from bentwing.fleet.pool import LocalPool

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from contextlib import AbstractContextManager

    from bentwing.base.progress import Progress
    from bentwing.fleet.pool import Job, Pool

    # Opens a pool for jobs of at most some memory, MB, and a number of them.
    Opened = Callable[[float, int], AbstractContextManager[Pool]]


def on_cluster(
    threads: int | None,
    progress: Progress,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    client: Any = None,  # noqa: ANN401 - dask's
) -> Opened:
    """Return what opens a pool on a cluster; see `map_fleet`."""
    if client is not None:
        return lambda _megabytes, _n_jobs: nullcontext(ClusterPool(client, threads))
    address = address_of(scheduler, workers)

    def opened(megabytes: float, n_jobs: int) -> AbstractContextManager[Pool]:
        if address is not None:
            return connected(address, threads, progress)
        n = n_side_by_side(megabytes, n_jobs, workers)
        return started(n, megabytes, threads, progress)

    return opened


def side_by_side(threads: int | None, progress: Progress) -> Opened:
    """Return what opens a pool on this machine, of two jobs at the same time where memory allows."""

    @contextmanager
    def opened(megabytes: float, n_jobs: int) -> Iterator[Pool]:
        n = n_side_by_side(megabytes, n_jobs, None)
        progress.note(
            f"{n} at a time: the largest recording takes about {megabytes / 1e3:.1f} GB, "
            f"{available_mb() / 1e3:.1f} GB are free"
        )
        with LocalPool(n, threads, progress.note) as pool:
            yield pool

    return opened


@dataclass(slots=True)
class LazyPool:
    """A pool that is opened when there is something to do."""

    opened: Opened
    stack: ExitStack
    pool: Pool | None = None

    def results(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
        """Run jobs; see `Pool`."""
        if not jobs:
            return iter(())
        if self.pool is None:
            most = max(job.megabytes for job in jobs)
            self.pool = self.stack.enter_context(self.opened(most, len(jobs)))
        return self.pool.results(jobs)
