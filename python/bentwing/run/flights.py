# SPDX-License-Identifier: MIT OR Apache-2.0
"""Several flights: each is mapped, then all are merged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.base.progress import Progress, as_progress
from bentwing.base.regular_file import resolved
from bentwing.run.check import opened
from bentwing.run.folder import RunFolder
from bentwing.run.merging import merge_into, open_sources
from bentwing.run.merging.source import distinct_names
from bentwing.run.pipeline import run_recording
from bentwing.run.request import inputs_of, record_of_request, request_of
from bentwing.run.settings import merge_settings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.run.merging import Merged
    from bentwing.run.settings import RunSettings

RUNS = "runs"
"""Folder of the flights' own runs in that of the merged map."""


def map_flights(
    flights: Sequence[Sequence[Path]],
    out: Path | str,
    settings: RunSettings,
    payload_file: Path | str | None = None,
    *,
    resume: bool = False,
    progress: Progress | None = None,
) -> Merged:
    """Map several flights, each into a folder of its own in `out`, and merge them.

    Parameters
    ----------
    flights : the files of each
    out : folder for the merged map; the runs of the flights go into `out/runs`
    settings : of each run; `start` and `duration` have no meaning here
    payload_file : that `settings.payload` was read from
    resume : leave flights that are mapped already, in the same way, as they are, and go on with others

    Raises
    ------
    UsageError, InputError, EstimationError
        With an EstimationError what was computed is kept in `out`, and run.json says how far.
    """
    for name in ("start", "duration"):
        if getattr(settings, name) is not None:
            msg = (
                f"--{name} with {len(flights)} flights: give it with one recording at a time, "
                "and merge the runs"
            )
            raise UsageError(msg)
    if settings.loops:
        msg = f"--loops with {len(flights)} flights: their times are of one recording; map each by itself"
        raise UsageError(msg)
    shown, names = as_progress(progress), flight_names(flights)
    merging = merge_settings(
        map_format=settings.map_format,
        map_spacing=settings.map_spacing,
        cleaning=settings.cleaning,
        refine=settings.refine,
        normals=settings.normals,
        georeferencing=settings.georeferencing,
        project=settings.project,
        threads=settings.threads,
        loop_closure=settings.closing,
        flights={n: [resolved(p) for p in f] for n, f in zip(names, flights, strict=True)},
    )
    for paths in flights:
        with opened(paths, settings, shown):
            pass  # none of them is mapped where another cannot be
    with RunFolder(Path(out), merging.to_json()) as folder:
        runs = [folder.path / RUNS / name for name in names]
        mapped: list[str] = []
        for name, run, paths in zip(names, runs, flights, strict=True):
            if resume and _is_mapped(run, paths, settings, payload_file):
                shown.note(f"{name}: is mapped already")
                continue
            shown.note(f"{name}:")
            with folder.stage(f"map {name}"):
                run_recording(paths, run, settings, payload_file, resume=resume, progress=shown)
            mapped.append(name)
        return merge_into(folder, open_sources(runs), merging, shown, mapped)


def flight_names(flights: Sequence[Sequence[Path]]) -> list[str]:
    """Name flights after their files, or after the folders of these where the files do not differ."""
    stems = [resolved(paths[0]).stem for paths in flights]
    if len(set(stems)) < len(stems):
        stems = [resolved(paths[0]).parent.name for paths in flights]
    return distinct_names(stems)


def _is_mapped(
    run: Path, paths: Sequence[Path], settings: RunSettings, payload_file: Path | str | None
) -> bool:
    """Whether a folder holds the complete run of a flight, made in the same way."""
    read = [*paths, *([] if payload_file is None else [Path(payload_file)])]
    where = [str(resolved(path)) for path in paths]
    return record_of_request(run, request_of(settings, inputs_of(read)), where) is not None
