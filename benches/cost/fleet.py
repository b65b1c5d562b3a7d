# SPDX-License-Identifier: MIT OR Apache-2.0
"""What dask's scheduler adds to the mapping of many thousand recordings, in time and memory.

The jobs are those of `bentwing fleet` with nothing in them but their duration. Some take ten times as
long, the process of some dies once, and workers go on the way. Scheduler and workers are in one process,
so its memory is more than the scheduler's. The time is compared with that of the same jobs, each begun as
soon as a worker is free and nothing lost with a worker that goes.
"""

from __future__ import annotations

import argparse
import heapq
import logging
import resource
import threading
import time
from dataclasses import dataclass

import dask
import numpy as np

from benches.support import tables
from bentwing.fleet.cluster import MEMORY, ClusterPool, require_dask
from bentwing.fleet.pool import Job
from bentwing.fleet.process import ProcessDiedError

STRAGGLERS, SLOWER = 0.01, 10.0
DEATHS = 0.01
MEGABYTES = 1500.0
COLUMNS = ("recordings", "workers", "of which go", "mean duration", "at best", "taken", "overhead",
    "processor time a recording", "peak memory", "not done")  # fmt: skip


@dataclass(frozen=True, slots=True)
class Work:
    """A recording that takes time and nothing else."""

    number: int
    seconds: float
    dies: bool


class Worker:
    """Does work; the process of some dies half-way, once."""

    died: set[int] = set()  # noqa: RUF012 - of this process, as the workers are

    @classmethod
    def do(cls, work: Work, threads: int | None) -> int:
        """Wait as long as the work takes."""
        del threads
        if work.dies and work.number not in cls.died:
            cls.died.add(work.number)
            time.sleep(0.5 * work.seconds)
            msg = "killed"
            raise ProcessDiedError(msg)
        time.sleep(work.seconds)
        return work.number


def jobs(n: int, seconds: float, seed: int) -> list[Work]:
    """Work of this mean duration, the largest first as `fleet` has it."""
    generator = np.random.default_rng(seed)
    durations = generator.uniform(0.5, 1.5, n)
    durations[generator.random(n) < STRAGGLERS] *= SLOWER
    durations = -np.sort(-durations) * (seconds / durations.mean())
    dies = generator.random(n) < DEATHS
    return [
        Work(k, float(d), bool(b)) for k, (d, b) in enumerate(zip(durations, dies, strict=True))
    ]


def at_best(work: list[Work], workers: int, ends: list[float]) -> float:
    """Time of the work in this order, each piece begun as soon as a worker is free.

    Some workers begin nothing after their end.
    """
    parts = [0.5 * w.seconds if w.dies else w.seconds for w in work]
    parts += [w.seconds for w in work if w.dies]
    free = [(0.0, end) for end in [*ends, *[float("inf")] * (workers - len(ends))]]
    heapq.heapify(free)
    last = 0.0
    for part in parts:
        while free[0][0] >= free[0][1]:
            heapq.heappop(free)
        begun, end = free[0]
        last = max(last, begun + part)
        heapq.heapreplace(free, (begun + part, end))
    return last


def main() -> None:
    """Print a row."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=int, nargs="?", default=10_000)
    parser.add_argument("--workers", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=1.0, help="mean duration")
    parser.add_argument("--lost", type=int, default=3, help="workers that go on the way")
    parser.add_argument("--seed", type=int, default=900)
    options = parser.parse_args()
    work = jobs(options.recordings, options.seconds, options.seed)
    even = options.recordings * options.seconds / options.workers
    ends = [(k + 1) * even / (options.lost + 1) for k in range(options.lost)]
    best = at_best(work, options.workers, ends)
    distributed = require_dask()
    with (
        dask.config.set({"distributed.worker.profile.enabled": False}),
        distributed.LocalCluster(
            n_workers=options.workers,
            threads_per_worker=1,
            processes=False,
            memory_limit=0,
            resources={MEMORY: 2 * MEGABYTES - 1},
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        going = zip(ends, list(cluster.workers.values()), strict=False)
        # Without a word to the scheduler.
        timers = [
            threading.Timer(
                end, cluster.sync, (worker.close,), {"executor_wait": False, "nanny": False}
            )
            for end, worker in going
        ]
        for timer in timers:
            timer.start()
        started, spent = time.monotonic(), time.process_time()
        pool = ClusterPool(client, 1)
        todo = [Job(f"map-{w.number}", Worker.do, w, MEGABYTES) for w in work]
        done = {job.task.number for job, result in pool.results(todo) if isinstance(result, int)}
        taken, spent = time.monotonic() - started, time.process_time() - spent
        for timer in timers:
            timer.cancel()
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(tables.head(COLUMNS))
    cells = (
        f"{len(work):,}", f"{options.workers}", f"{options.lost}", f"{options.seconds:g} s",
        f"{best:.1f} s", f"{taken:.1f} s", f"{taken / best - 1:.1%}",
        f"{1e3 * spent / len(work):.2f} ms", f"{peak:.2f} GB", f"{len(work) - len(done)}",
    )  # fmt: skip
    print(tables.line(cells))
