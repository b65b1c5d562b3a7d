# SPDX-License-Identifier: MIT OR Apache-2.0
"""The maps of runs that were put together: one registration and one cloud for each group."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.run_record import RECORD, read_record
from bentwing.base.trajectory import DT
from bentwing.closing.global_registration import Recorded, register_jointly
from bentwing.closing.global_registration.stretches import Stretches
from bentwing.closing.joining.matches import Match, Part
from bentwing.odometry.segments import joined
from bentwing.run.folder import RunFolder
from bentwing.run.merging.writing import one_after_the_other, write_map, write_trajectories
from bentwing.run.report import report_run
from bentwing.run.run import Run

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.progress import Progress
    from bentwing.closing.joining.placing import Placed
    from bentwing.closing.joining.survey import Survey
    from bentwing.run.merging.source import Source
    from bentwing.run.merging.writing import MapOptions


@dataclass(frozen=True, slots=True)
class MergedMap:
    """One map.

    Attributes
    ----------
    out : its folder
    names : of the runs in it
    estimates : of the runs, in the frame of the map
    """

    out: Path
    names: list[str]
    estimates: list[Estimate]


@dataclass(frozen=True, slots=True)
class Ingredients:
    """What all maps are made of."""

    sources: list[Source]
    surveys: list[Survey]
    options: MapOptions
    watch: Progress


def make_maps(
    folder: RunFolder, groups: Sequence[Placed], matches: list[Match], found: Ingredients
) -> list[MergedMap]:
    """Make the map of each group: in the folder, or where there are several in sub-folders.

    Parameters
    ----------
    folder : whose record has `merging`, with a list `maps` that is filled
    groups : of parts that belong together
    matches : all of them
    """
    record = folder.record["merging"]
    if len(groups) > 1:
        maps = _separate_maps(folder, record, groups, matches, found)
    else:
        names = [source.name for source in found.sources]
        _add_map(record, ".", groups[0], names, matches)
        folder.record["warnings"] += _warnings(groups[0], found.sources, matches)
        maps = [_one_map(folder, groups[0], found)]
    _remove_earlier_maps(folder.path, {one.out.name for one in maps})
    return maps


def _add_map(
    record: dict[str, Any], where: str, group: Placed, names: Sequence[str], matches: list[Match]
) -> None:
    """Say what a map consists of."""
    runs = sorted({part.run for part in group.trajectories})
    links = [m for m in matches if m.believed and m.a in group.trajectories]
    record["maps"].append(
        {
            "folder": where,
            "runs": [names[run] for run in runs],
            "n_links": len(links),
            "graph": group.record,
        }
    )


def _warnings(group: Placed, sources: Sequence[Source], matches: Sequence[Match]) -> list[str]:
    """Return those of the runs in a group, and where a run hangs by one place only."""
    runs = sorted({part.run for part in group.trajectories})
    told = [f"{sources[run].name}: {warning}" for run in runs for warning in sources[run].warnings]
    believed = [m for m in matches if m.believed and m.a.run != m.b.run]
    for run in runs:
        links = [m for m in believed if run in {m.a.run, m.b.run}]
        if len(links) == 1:
            other = ({links[0].a.run, links[0].b.run} - {run}).pop()
            told.append(
                f"{sources[run].name} is joined by a single place, with {sources[other].name}: look "
                "whether the map is as it should be there"
            )
    return told


def _separate_maps(
    folder: RunFolder,
    record: dict[str, Any],
    groups: Sequence[Placed],
    matches: list[Match],
    found: Ingredients,
) -> list[MergedMap]:
    names = [source.name for source in found.sources]
    maps, told = [], []
    for number, group in enumerate(groups, start=1):
        name = f"map_{number}"
        _add_map(record, name, group, names, matches)
        told.append(f"{name} ({', '.join(record['maps'][-1]['runs'])})")
        with RunFolder(folder.path / name, folder.record["settings"]) as own:
            own.record["warnings"] += _warnings(group, found.sources, matches)
            own.record["merging"] = {**record, "maps": record["maps"][-1:]}
            numbers = {part.run for part in group.trajectories}
            own.add_inputs([p for n in sorted(numbers) for p in found.sources[n].recordings])
            maps.append(_one_map(own, group, found))
    folder.record["warnings"].append(
        "not all of the runs have places in common that could be recognised: they are "
        f"{len(groups)} separate maps, {', '.join(told)}, and where these lie relative to each other "
        "is unknown"
    )
    with folder.stage("report"):
        folder.save()
        report_run(folder, Run(folder.path), complete=True)
    return maps


def _remove_earlier_maps(folder: Path, kept: set[str]) -> None:
    """Remove separate maps that an earlier merging has left in sub-folders."""
    for path in folder.glob("map_*"):
        if path.name in kept or not path.is_dir():
            continue
        try:
            record = read_record(path)
        except UsageError:
            continue
        if record.get("merging"):
            for name in [*record.get("files", []), RECORD]:
                (path / Path(name).name).unlink(missing_ok=True)
            with suppress(OSError):  # what is not ours stays
                path.rmdir()


def _one_map(folder: RunFolder, group: Placed, found: Ingredients) -> MergedMap:
    """Register the runs of a group with each other, and write their map."""
    numbers = sorted({part.run for part in group.trajectories})
    sources = [found.sources[n] for n in numbers]
    recorded = [_moved(found.surveys[n].recorded, group, n) for n in numbers]
    estimates = [r.estimate for r in recorded]
    if len(numbers) > 1:
        with folder.stage("register"), found.watch.stage("register") as _:
            result = register_jointly(recorded, threads=found.options.threads)
        estimates = result.estimates
        folder.record["loop_closure"] = result.record
        if result.failure is not None:
            folder.record["warnings"].append(
                "the runs were put together by their places only, they were not registered with each "
                f"other: {result.failure}"
            )
    run = Run(folder.path)
    with folder.stage("map"):
        write_trajectories(folder, sources, [r.estimate for r in recorded], estimates)
        write_map(folder, sources, run, estimates, options=found.options, watch=found.watch)
    run.estimate = Estimate(one_after_the_other(estimates), estimates[0].calibration)
    with folder.stage("report"):
        folder.save()
        report_run(folder, run, complete=True)
    return MergedMap(folder.path, [source.name for source in sources], estimates)


def _moved(recorded: Recorded, group: Placed, number: int) -> Recorded:
    """Return a run where its group has put it."""
    segments = [
        Stretches(group.trajectories[Part(number, s)], stretches.surfels)
        for s, stretches in enumerate(recorded.segments)
    ]
    trajectory = joined([s.trajectory for s in segments], DT)
    estimate = replace(recorded.estimate, trajectory=trajectory)
    return replace(recorded, estimate=estimate, segments=segments)
