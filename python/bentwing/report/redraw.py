# SPDX-License-Identifier: MIT OR Apache-2.0
"""The report of a finished run drawn again: with another project, after an update, or for paper."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.folder_lock import FolderLock
from bentwing.base.new_file import require_folder
from bentwing.base.plain import plain
from bentwing.base.progress import as_progress
from bentwing.base.provenance import describe_input
from bentwing.base.run_record import RECORD
from bentwing.evaluate.revisits import revisit_consistency
from bentwing.map.sample import VALUES
from bentwing.report.finished import ShownRun
from bentwing.report.page import write_report
from bentwing.report.pdf import find_browser, write_pdf

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.progress import Progress
    from bentwing.recording.sections.project import Project

PAGE, PAPER = "report.html", "report.pdf"
_MOST = 1_200_000  # points; a run's first report shows as many


def redraw_report(
    run: Path | str,
    *,
    project: Project | None = None,
    pdf: bool = False,
    progress: Progress | None = None,
) -> list[Path]:
    """Draw the report of a finished run again, into its folder.

    Parameters
    ----------
    run : folder that `bentwing map`, `merge` or `localize` has written
    project : what the first page names; default: as before
    pdf : whether it is printed as report.pdf, too
    progress : what to tell the user meanwhile

    Returns
    -------
    The files that were written.

    Raises
    ------
    UsageError
        If it is no complete run, it cannot be written to, another process writes there, or no browser
        can print.
    InputError
        If a file in it cannot be read.
    """
    browser = find_browser() if pdf else None
    shown, finished = as_progress(progress), ShownRun.open(run)
    folder, record = finished.run.folder, finished.run.record
    if project is not None:
        record["project"] = plain(project.model_dump())
    require_folder(folder)
    lock = FolderLock(folder)
    lock.acquire()
    try:
        _forget(folder, record)
        with shown.stage("draw the report"):
            points, times, values = _sample(finished)
            write_report(
                folder / PAGE,
                run_json=record,
                trajectory=finished.trajectory,
                map_sample=(points, times),
                map_values=values,
                revisits=revisit_consistency(points, times) if len(points) else None,
                change=finished.change(),
            )
        written = [folder / PAGE]
        if browser is not None:
            with shown.stage("print the report"):
                write_pdf(folder / PAGE, folder / PAPER, browser)
            written.append(folder / PAPER)
        for path in written:
            _remember(folder, record, path)
    finally:
        lock.release()
    return written


def _sample(
    finished: ShownRun,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float32]]:
    """Return every k-th point of the map, its time and its `VALUES`, in the order of time."""
    n = int((finished.run.record.get("counts") or {}).get("map.written", 0))
    step = 1
    while n > step * _MOST:
        step *= 2
    nothing = (np.empty((0, 3)), np.empty(0), np.empty((0, len(VALUES)), np.float32))
    drawn = finished.sample(step) if finished.run.map_path is not None else ()
    points, times, values = (np.concatenate(part) for part in zip(nothing, *drawn, strict=True))
    return points, times, values


def _forget(folder: Path, record: dict[str, Any]) -> None:
    """Let the record vouch for no report while that is written."""
    for name in (PAGE, PAPER):
        record.get("hashes", {}).pop(name, None)
    if PAPER in record.get("files", []):
        record["files"].remove(PAPER)
        (folder / PAPER).unlink(missing_ok=True)
    _save(folder, record)


def _remember(folder: Path, record: dict[str, Any], path: Path) -> None:
    found = describe_input(path)
    record.setdefault("hashes", {})[path.name] = {
        key: found[key] for key in ("bytes", "sha256", "hashed")
    }
    if path.name not in record.setdefault("files", []):
        record["files"].append(path.name)
    _save(folder, record)


def _save(folder: Path, record: dict[str, Any]) -> None:
    write_text(folder / RECORD, json.dumps(record, indent=1, allow_nan=False) + "\n")
