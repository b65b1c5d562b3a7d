# SPDX-License-Identifier: MIT OR Apache-2.0
"""Work on a cluster of dask.distributed: on this machine, or on those that a scheduler knows."""

from __future__ import annotations

import logging
import os
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import InputError, UsageError
from bentwing.base.interrupts import postponed
from bentwing.fleet.memory import available_mb
from bentwing.fleet.pool import threads_among

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.base.progress import Progress
    from bentwing.fleet.pool import Job

ADDRESS = "DASK_ADDRESS"
MEMORY = "MEM"
"""Resource of workers: the memory that they have for bentwing, MB."""
RETRIES = 2
"""Times that work is tried again which ended without an answer, each time with twice the memory."""
# A recording is not to blame for every worker that dies while it maps it; and there is nothing to
# profile in a worker that waits for a process.
_OF_CLUSTER = {
    "distributed.scheduler.allowed-failures": 20,
    "distributed.worker.profile.enabled": False,
}
_PATIENCE = "20s"


def require_dask() -> Any:  # noqa: ANN401 - dask has few types
    """Import dask.distributed.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    try:
        import distributed
    except ImportError:
        msg = (
            "bentwing fleet needs dask.distributed, which is not installed: "
            "pip install 'bentwing[fleet]'; without it, `bentwing map FOLDER -o OUT` maps on this machine"
        )
        raise UsageError(msg) from None
    return distributed


class ClusterPool:
    """Runs jobs on the workers of a client.

    Parameters
    ----------
    client : of dask.distributed
    threads : of each job; default: the cores of the worker's machine, or with `n_here` a share of them
    n_here : workers, where they are on this machine
    """

    def __init__(self, client: Any, threads: int | None, n_here: int | None = None) -> None:  # noqa: ANN401 - dask's
        self._client, self._threads, self._n_here = client, threads, n_here

    def results(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Any]]:
        """Yield each job with its result or exception, after trying again with twice the memory."""
        most = _memory_of_workers(self._client)
        threads = self._threads
        if self._n_here is not None:
            threads = threads_among(self._n_here, len(jobs), threads)
        futures = {self._submit(job, threads, most, 0): (job, 0) for job in jobs}
        completed = require_dask().as_completed(list(futures))
        try:
            for future in completed:
                job, n_failures = futures.pop(future)
                error = future.exception()
                if error is not None and n_failures < RETRIES:
                    again = self._submit(job, threads, most, n_failures + 1)
                    futures[again] = job, n_failures + 1
                    completed.add(again)
                else:
                    yield job, error or future.result()
        finally:
            self._client.cancel(list(futures))

    def _submit(self, job: Job, threads: int | None, most: float | None, n_failures: int) -> Any:  # noqa: ANN401 - dask's
        """Give a job to the cluster, with more memory each time that it failed."""
        megabytes = job.megabytes * 2**n_failures
        return self._client.submit(
            job.function,
            job.task,
            threads,
            # A key that failed is remembered as failed.
            key=job.key if n_failures == 0 else f"{job.key}-again-{n_failures}",
            # More than the largest worker has would wait for ever.
            resources=None if most is None else {MEMORY: min(megabytes, most)},
        )


def address_of(scheduler: str | None, workers: int | None) -> str | None:
    """Return the address of the scheduler to use: given, in DASK_ADDRESS, or in dask's configuration.

    Raises
    ------
    UsageError
        If dask is not installed, or there is an address and workers are to be started here, too.
    """
    require_dask()
    import dask

    address = scheduler or os.environ.get(ADDRESS) or dask.config.get("scheduler-address", None)
    if address and workers:
        msg = f"--workers starts a cluster here, but there is a scheduler at {address}: give one of them"
        raise UsageError(msg)
    return None if address is None else str(address)


@contextmanager
def connected(address: str, threads: int | None, progress: Progress) -> Iterator[ClusterPool]:
    """Connect to a scheduler.

    Raises
    ------
    InputError
        If none answers.
    """
    try:
        client = require_dask().Client(address, timeout=_PATIENCE)
    except (OSError, ValueError) as error:
        msg = f"{address}: no dask scheduler answers there ({error}); check the address"
        raise InputError(msg) from error
    with client:
        _say(client, progress)
        yield ClusterPool(client, threads)


@contextmanager
def started(
    n: int, megabytes: float, threads: int | None, progress: Progress
) -> Iterator[ClusterPool]:
    """Start a cluster on this machine.

    Parameters
    ----------
    n : workers
    megabytes : of memory that the largest job takes
    """
    distributed = require_dask()
    import dask

    each = available_mb() / n
    progress.note(
        f"{n} worker{'s' if n > 1 else ''} on this machine, {each / 1e3:.1f} GB each; "
        f"the largest recording takes about {megabytes / 1e3:.1f} GB"
    )
    with dask.config.set(_OF_CLUSTER), ExitStack() as stack:
        with postponed():  # dask cannot close a cluster that is half started
            cluster = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=n,
                    threads_per_worker=1,
                    memory_limit=0,  # the work is not in the worker but in a process of its own
                    resources={MEMORY: max(each, megabytes)},
                    dashboard_address="127.0.0.1:0",
                    silence_logs=logging.CRITICAL,
                )
            )
            client = stack.enter_context(distributed.Client(cluster))
        _say(client, progress, "" if find_spec("bokeh") else "; pip install bokeh to see it")
        yield ClusterPool(client, threads, n)


def _say(client: Any, progress: Progress, hint: str = "") -> None:  # noqa: ANN401 - dask's
    if link := client.dashboard_link:
        progress.note(f"dashboard: {link}{hint}")


def _memory_of_workers(client: Any) -> float | None:  # noqa: ANN401 - dask's
    """Return what the largest worker declares, MB; None where one of them declares nothing."""
    workers = client.scheduler_info(n_workers=-1)["workers"].values()
    declared = [worker["resources"].get(MEMORY) for worker in workers]
    return max(declared) if declared and None not in declared else None
