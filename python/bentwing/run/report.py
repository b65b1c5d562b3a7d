# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report and the picture of a run, into its folder."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from bentwing.base.progress import Progress
    from bentwing.run.folder import RunFolder
    from bentwing.run.found import Found


_NOWHERE = Trajectory(np.empty(0), np.empty((0, 3)), np.empty((0, 4)))


def report_run(folder: RunFolder, found: Found, trajectory: Trajectory | None = None) -> None:
    """Write report.html and map_top.png of a run whose other stages are done.

    Parameters
    ----------
    trajectory : of the map; default: of the estimate
    """
    folder.record.stage = "report"
    folder.save()
    _write(folder, found, trajectory, complete=True)


def say_warnings(progress: Progress, warnings: Iterable[str]) -> None:
    """Say what the user must know of a run before using its result."""
    for text in warnings:
        progress.note(f"warning: {text}")


def report_failure(folder: RunFolder, error: BaseException) -> None:
    """Write a report without a map, so that none of an earlier run remains."""
    folder.fail(error)
    _write(folder, replace(folder.record.found, map=None), None, complete=False)


def _write(
    folder: RunFolder, found: Found, trajectory: Trajectory | None, *, complete: bool
) -> None:
    # behind all other stages, so that a run begins without them
    from bentwing.report.page import write_report
    from bentwing.report.picture import render_top, write_png
    from bentwing.report.views import overhead_points

    if trajectory is None:
        trajectory = _NOWHERE if found.estimate is None else found.estimate.trajectory
    started = time.monotonic()
    points, times = found.sample.points, found.sample.times

    def draw_top(path: Path) -> None:
        overhead = overhead_points(points, times, trajectory)
        seen = points[~overhead] if overhead.any() else points
        write_png(path, render_top(seen))

    with ThreadPoolExecutor(1) as beside:
        top = beside.submit(draw_top, folder.file("map_top.png")) if len(points) else None
        write_report(
            folder.file("report.html"),
            run_json={**folder.described(), "complete": complete},
            trajectory=trajectory,
            map_sample=(points, times),
            map_values=found.sample.values,
            revisits=None if found.map is None else found.map.revisits,
            change=None if found.map is None else found.map.change,
            spin=found.spin.series,
            cost=lambda: folder.record.settle(time.monotonic() - started),
        )
        if top is not None:
            top.result()
