# SPDX-License-Identifier: MIT OR Apache-2.0
"""Several runs into one map, or into as many as have nothing in common: the room on one screen."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.estimators.interface import Estimate
from bentwing.estimators.segments import joined
from bentwing.global_registration import Budget, GlobalSettings, Recorded, register_jointly
from bentwing.global_registration.stretches import Stretches, length_of
from bentwing.map.writer import require_format
from bentwing.merging.describe import describe_matches, describe_parts_of
from bentwing.merging.matches import Match, Part, find_matches, parts_of
from bentwing.merging.placing import Placed, place_groups
from bentwing.merging.source import DT, Source, open_sources
from bentwing.merging.survey import Survey, survey
from bentwing.merging.writing import (
    MapOptions,
    as_settings,
    one_after_the_other,
    write_map,
    write_trajectories,
)
from bentwing.preprocess import RecordingPart
from bentwing.progress import Progress
from bentwing.recording import Recording
from bentwing.report import report_run
from bentwing.run import Run
from bentwing.run_folder import RunFolder

if TYPE_CHECKING:
    from collections.abc import Sequence


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
class Merged:
    """What became of several runs.

    Attributes
    ----------
    out : the folder
    maps : one, or more where runs have no place in common
    record : what run.json says about the merging
    """

    out: Path
    maps: list[MergedMap]
    record: dict[str, Any]


@dataclass(frozen=True, slots=True)
class _Found:
    """What all maps are made of."""

    sources: list[Source]
    surveys: list[Survey]
    options: MapOptions
    watch: Progress


def merge(
    runs: Sequence[Path | str],
    out: Path | str,
    *,
    map_format: str = "laz",
    map_spacing: float = 0.0,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Merged:
    """Merge runs into one map, without a guess where they lie.

    Places that several runs saw are recognised, a robust pose graph puts the runs together, and one
    non-rigid registration corrects all of them and their calibrations at once (Kaul 2015, section
    2.2). Runs without a place in common are not forced together: each group becomes a map of its own
    in a sub-folder of `out`.

    Parameters
    ----------
    runs : folders that `bentwing map` has written; their recordings are read again
    out : folder for the result; see `RunFolder` for what may be there already
    map_format : one of `MAP_FORMATS`
    map_spacing : m, edge of the voxels that keep one point each; 0 keeps all points
    threads : default: all cores
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError, EstimationError
    """
    require_format(map_format)
    sources = open_sources([Path(run) for run in runs])
    options = MapOptions(map_format, map_spacing, threads)
    settings = {"runs": [str(s.folder.resolve()) for s in sources], **as_settings(options)}
    with RunFolder(Path(out), settings) as folder:
        return merge_into(folder, sources, options, progress or Progress())


def merge_into(
    folder: RunFolder, sources: list[Source], options: MapOptions, watch: Progress
) -> Merged:
    """Merge opened runs into a folder that is open, too; see `merge`."""
    with folder.stage("inputs"):
        folder.add_inputs([path for source in sources for path in source.recordings])
    with folder.stage("survey"):
        surveys = _surveyed(sources, options, watch)
    parts = parts_of(surveys)
    with folder.stage("match"), watch.stage("match", _n_pairs(len(parts)), "pairs") as shown:
        matches = find_matches(parts, shown)
    trajectories = {
        Part(r, s): stretches.trajectory
        for r, one in enumerate(surveys)
        for s, stretches in enumerate(one.recorded.segments)
    }
    ties = [(part, Part(part.run, part.segment + 1)) for part in parts]
    with folder.stage("place"):
        groups, matches = place_groups(
            trajectories, parts, matches, [tie for tie in ties if tie[1] in parts]
        )
    names = [source.name for source in sources]
    record = {
        "parts": describe_parts_of(names, parts),
        "candidates": describe_matches(names, matches),
        "maps": [],
    }
    folder.record["merging"] = record
    folder.save()
    found = _Found(sources, surveys, options, watch)
    if len(groups) == 1:
        _add_map(record, ".", groups[0], names, matches)
        maps = [_one_map(folder, groups[0], found)]
    else:
        maps = _separate_maps(folder, record, groups, matches, found)
    return Merged(folder.path, maps, record)


def _n_pairs(n: int) -> float:
    return n * (n - 1) / 2


def _surveyed(sources: Sequence[Source], options: MapOptions, watch: Progress) -> list[Survey]:
    seconds = sum(length_of(source.estimate) for source in sources)
    budget = Budget.of(seconds, GlobalSettings())
    watch.note(f"merging: {budget.sentence()}")
    surveys = []
    for source in sources:
        with Recording(source.recordings, source.payload) as recording:
            part = RecordingPart(recording, source.payload, source.start, source.duration)
            with watch.stage(f"survey {source.name}", part.length) as shown:
                surveys.append(
                    survey(
                        source.name,
                        source.estimate,
                        part.batches(shown, Counter()),
                        source.payload,
                        surfel_rate=budget.rate,
                        threads=options.threads,
                    )
                )
    return surveys


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


def _separate_maps(
    folder: RunFolder,
    record: dict[str, Any],
    groups: Sequence[Placed],
    matches: list[Match],
    found: _Found,
) -> list[MergedMap]:
    names = [source.name for source in found.sources]
    maps, told = [], []
    for number, group in enumerate(groups, start=1):
        name = f"map_{number}"
        _add_map(record, name, group, names, matches)
        told.append(f"{name} ({', '.join(record['maps'][-1]['runs'])})")
        with RunFolder(folder.path / name, folder.record["settings"]) as own:
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


def _one_map(folder: RunFolder, group: Placed, found: _Found) -> MergedMap:
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
