# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report and the picture of a run, into its folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.page import write_report
from bentwing.report.picture import render_top, write_png
from bentwing.report.views import overhead_points

if TYPE_CHECKING:
    from bentwing.run.folder import RunFolder
    from bentwing.run.run import Run


def report_run(folder: RunFolder, run: Run, *, complete: bool) -> None:
    """Write report.html and, where there is a map, map_top.png."""
    points, times = run.sample.points, run.sample.times
    write_report(
        folder.file("report.html"),
        run_json={**folder.record, "complete": complete},
        trajectory=run.trajectory,
        map_sample=(points, times),
        spin=(np.array(run.spin_times), np.array(run.spin_rates)) if run.spin_times else None,
    )
    if len(points):
        overhead = overhead_points(points, times, run.trajectory)
        seen = points[~overhead] if overhead.any() else points
        write_png(folder.file("map_top.png"), render_top(seen))
