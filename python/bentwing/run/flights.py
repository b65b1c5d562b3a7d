# SPDX-License-Identifier: MIT OR Apache-2.0
"""Several flights: each is mapped, then all are merged."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.base.plain import plain
from bentwing.base.progress import Progress
from bentwing.base.run_record import read_record
from bentwing.map.clean import CleanSettings
from bentwing.run.folder import RunFolder
from bentwing.run.merging import merge_into, open_sources
from bentwing.run.merging.source import distinct_names
from bentwing.run.merging.writing import MapOptions
from bentwing.run.pipeline import map_recording
from bentwing.run.settings import load_payload

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.recording import Payload
    from bentwing.run.merging import Merged

RUNS = "runs"
"""Folder of the flights' own runs in that of the merged map."""


def map_flights(
    flights: Sequence[Sequence[Path]],
    payload: Payload | Path | str | None,
    out: Path | str,
    *,
    map_format: str = "laz",
    map_spacing: float = 0.0,
    cleaning: CleanSettings | None = None,
    threads: int | None = None,
    resume: bool = False,
    progress: Progress | None = None,
    **options: Any,  # noqa: ANN401 - handed on as they are
) -> Merged:
    """Map several flights, each into a folder of its own in `out`, and merge them.

    Parameters
    ----------
    flights : the files of each
    out : folder for the merged map; the runs of the flights go into `out/runs`
    resume : leave flights that are mapped already, in the same way, as they are, and go on with others
    options : further ones of `map_recording`; `start` and `duration` have no meaning here

    Raises
    ------
    UsageError, InputError, EstimationError
        With an EstimationError what was computed is kept in `out`, and run.json says how far.
    """
    for name in ("start", "duration"):
        if options.get(name) is not None:
            msg = (
                f"--{name} with {len(flights)} flights: give it with one recording at a time, "
                "and merge the runs"
            )
            raise UsageError(msg)
    watch, names = progress or Progress(), flight_names(flights)
    asked = MapOptions(map_format, map_spacing, threads, cleaning or CleanSettings())
    settings = {
        "flights": {n: [str(p.resolve()) for p in f] for n, f in zip(names, flights, strict=True)},
        **plain(asked),
        **plain(options),
    }
    with RunFolder(Path(out), settings) as folder:
        runs = []
        same = {
            **options,
            "map_format": map_format,
            "map_spacing": map_spacing,
            "cleaning": asked.cleaning,
        }
        for name, paths in zip(names, flights, strict=True):
            run = Path(out) / RUNS / name
            runs.append(run)
            if resume and _is_mapped(run, paths, payload, same):
                watch.note(f"{name}: is mapped already")
                continue
            watch.note(f"{name}:")
            with folder.stage(f"map {name}"):
                map_recording(
                    paths,
                    payload,
                    run,
                    map_format=map_format,
                    map_spacing=map_spacing,
                    cleaning=asked.cleaning,
                    threads=threads,
                    resume=resume,
                    progress=watch,
                    **options,
                )
        return merge_into(folder, open_sources(runs), asked, watch)


def flight_names(flights: Sequence[Sequence[Path]]) -> list[str]:
    """Name flights after their files, or after the folders of these where the files do not differ."""
    stems = [paths[0].resolve().stem for paths in flights]
    if len(set(stems)) < len(stems):
        stems = [paths[0].resolve().parent.name for paths in flights]
    return distinct_names(stems)


def _is_mapped(
    run: Path,
    paths: Sequence[Path],
    payload: Payload | Path | str | None,
    options: dict[str, Any],
) -> bool:
    """Whether a folder holds the complete run of a flight, made in the same way."""
    try:
        record = read_record(run)
    except UsageError:
        return False
    settings = record.get("settings") or {}
    same = all(
        bool(settings.get(name)) == value
        if isinstance(value, bool)
        else settings.get(name) == plain(value)
        for name, value in options.items()
        if name in settings
    )
    return (
        bool(record.get("complete"))
        and record.get("recordings") == [str(path.resolve()) for path in paths]
        and settings.get("payload") == plain(load_payload(payload))
        and same
    )
