# SPDX-License-Identifier: MIT OR Apache-2.0
"""The maps of runs that were put together: one registration and one cloud for each group."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from bentwing.base.run_record import RUN_FOLDER
from bentwing.base.trajectory import DT
from bentwing.closing.global_registration import Recorded, register_jointly
from bentwing.closing.global_registration.stretches import Stretches
from bentwing.closing.joining.matches import Match, Part
from bentwing.evaluate.verdict import judge_closing, judge_joins, judge_marks, judge_revisits
from bentwing.odometry.segments import joined
from bentwing.run.folder import RunFolder
from bentwing.run.found import Found
from bentwing.run.mapping import joined_trajectory, write_map
from bentwing.run.merging.joins import joins_of
from bentwing.run.merging.on_earth import place_on_earth
from bentwing.run.merging.trajectories import write_trajectories
from bentwing.run.report import report_run, say_warnings

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence
    from pathlib import Path

    from bentwing.base.estimate import Estimate
    from bentwing.base.progress import Progress
    from bentwing.closing.joining.placing import Placed
    from bentwing.closing.joining.survey import Survey
    from bentwing.evaluate.verdict import Evidence, Verdict
    from bentwing.run.merging.joins import Join
    from bentwing.run.merging.on_earth import OnEarth
    from bentwing.run.merging.source import Source
    from bentwing.run.settings import MergeSettings


@dataclass(frozen=True, slots=True)
class MergedMap:
    """One map.

    Attributes
    ----------
    out : its folder
    names : of the runs in it
    estimates : of the runs, in the frame of the map
    verdict : whether it can be used, and why not
    """

    out: Path
    names: list[str]
    estimates: list[Estimate]
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Ingredients:
    """What all maps are made of.

    Attributes
    ----------
    matches : of places, all of them
    record : what run.json says about them
    said : warnings that the user has been told of already
    """

    sources: list[Source]
    surveys: list[Survey]
    matches: list[Match]
    record: Mapping[str, Any]
    settings: MergeSettings
    progress: Progress
    said: Collection[str] = ()


def make_maps(folder: RunFolder, groups: Sequence[Placed], found: Ingredients) -> list[MergedMap]:
    """Make the map of each group: in the folder, or where there are several in sub-folders.

    Parameters
    ----------
    groups : of parts that belong together
    """
    _remove_earlier_maps(folder.path)
    if len(groups) > 1:
        maps = _separate_maps(folder, groups, found)
    else:
        maps = [_one_map(folder, groups[0], found, describe_map(".", groups[0], found))]
    return maps


def describe_map(where: str, group: Placed, found: Ingredients) -> dict[str, Any]:
    """Say what a map consists of."""
    links = [m for m in found.matches if m.believed and m.a in group.trajectories]
    return {
        "folder": where,
        "runs": [found.sources[run].name for run in _numbers(group)],
        "n_links": len(links),
        "joins": [one.described([s.name for s in found.sources]) for one in _joins(group, found)],
        "graph": group.record,
    }


def _numbers(group: Placed) -> list[int]:
    return sorted({part.run for part in group.trajectories})


def _warnings(group: Placed, found: Ingredients) -> list[str]:
    """Return those of the runs in a group."""
    return [warning for run in _numbers(group) for warning in found.sources[run].told]


def _joins(group: Placed, found: Ingredients) -> list[Join]:
    members = _numbers(group)
    links = [m for m in found.matches if m.believed and {m.a.run, m.b.run} <= {*members}]
    return joins_of((m.a.run, m.b.run) for m in links)


def _judged(group: Placed, found: Ingredients, fixed: set[str]) -> list[Evidence]:
    """Judge by what the positions of the runs rest on, where fixes do not say them."""
    names = [source.name for source in found.sources]
    pairs = [(names[one.a], names[one.b]) for one in _joins(group, found) if not one.is_confirmed]
    return judge_joins([pair for pair in pairs if not fixed >= {*pair}])


def _with_fixes(on_earth: OnEarth) -> set[str]:
    """Return the names of the runs whose own fixes agree with where they are."""
    fixes = {} if on_earth.placed is None else on_earth.placed.record.get("fixes") or {}
    return {one["name"] for one in fixes.get("runs") or [] if one["used"] and not one["disagrees"]}


def make_map(
    out: Path,
    group: Placed,
    found: Ingredients,
    described: dict[str, Any],
    settings: dict[str, Any],
    *,
    request: str | None = None,
) -> MergedMap:
    """Make the map of one group, in a folder of its own.

    Parameters
    ----------
    described : what `describe_map` says
    settings : in plain JSON types, for run.json
    request : SHA-256 of what was asked, by which the map can be told again
    """
    with RunFolder(out, settings) as folder:
        folder.record.request = request
        sources = [found.sources[n] for n in _numbers(group)]
        folder.add_inputs([path for source in sources for path in source.recordings])
        return _one_map(folder, group, found, described)


def _separate_maps(
    folder: RunFolder, groups: Sequence[Placed], found: Ingredients
) -> list[MergedMap]:
    maps, described = [], []
    for number, group in enumerate(groups, start=1):
        one = describe_map(f"map_{number}", group, found)
        described.append(one)
        out = folder.path / one["folder"]
        maps.append(make_map(out, group, found, one, folder.record.settings))
    told = ", ".join(f"{one['folder']} ({', '.join(one['runs'])})" for one in described)
    note = (
        "bentwing did not recognize common places of all runs: they are "
        f"{len(groups)} separate maps, {told}, and their relative poses are unknown"
    )
    folder.record.found = Found(
        merging={**found.record, "maps": described},
        stage_warnings=(note,),
        judged=tuple(reason for one in maps for reason in one.verdict.reasons),
    )
    say_warnings(found.progress, [note])
    report_run(folder, folder.record.found)
    return maps


def _remove_earlier_maps(folder: Path) -> None:
    """Remove separate maps that an earlier merging has left in sub-folders."""
    for path in folder.glob("map_*"):
        record = RUN_FOLDER.read(path) or {}
        if record.get("merging"):
            RUN_FOLDER.remove(path)


def _one_map(
    folder: RunFolder, group: Placed, found: Ingredients, described: dict[str, Any]
) -> MergedMap:
    """Register the runs of a group with each other, and write their map."""
    sources = [found.sources[n] for n in _numbers(group)]
    recorded = [_moved(found.surveys[n].recorded, group, n) for n in _numbers(group)]
    placed = estimates = [r.estimate for r in recorded]
    notes, closing = _warnings(group, found), None
    if len(sources) > 1:
        with folder.stage("register"), found.progress.stage("register"):
            result = register_jointly(
                recorded, settings=found.settings.loop_closure, threads=found.settings.threads
            )
        estimates, closing = result.estimates, result.record
        if result.failure is not None:
            notes.append(
                "the runs were put together by their places only, they were not registered with each "
                f"other: {result.failure}"
            )
    with folder.stage("georeference"):
        threads = found.settings.threads
        seen = [s.points(e, threads=threads) for s, e in zip(sources, estimates, strict=True)]
        on_earth = place_on_earth(sources, seen, found.settings.georeferencing)
    estimates = on_earth.estimates
    notes += on_earth.warnings
    trajectory = joined_trajectory(estimates)
    sigma = max(source.payload.lidar.range_sigma for source in sources)
    with folder.stage("map"):
        runs = write_trajectories(folder, sources, placed, estimates)
        written = write_map(
            folder,
            [
                s.points(e, threads=threads, progress=found.progress)
                for s, e in zip(sources, estimates, strict=True)
            ],
            found.settings,
            duration=float(trajectory.times[-1]),
            placed=on_earth.placed,
        )
    folder.record.found = Found(
        loop_closure=closing,
        merging={**found.record, "maps": [described]},
        placed=on_earth.placed,
        map=written,
        runs=runs,
        stage_warnings=tuple(notes),
        evidence=(
            *judge_closing(closing, placed),
            *_judged(group, found, _with_fixes(on_earth)),
            *judge_revisits(written.revisits, sigma),
            *(judge_marks(on_earth.placed.record) if on_earth.placed else ()),
        ),
        judged=tuple(reason for source in sources for reason in source.reasons),
    )
    say_warnings(found.progress, [note for note in notes if note not in found.said])
    report_run(folder, folder.record.found, trajectory)
    names = [source.name for source in sources]
    return MergedMap(folder.path, names, estimates, folder.record.found.verdict)


def _moved(recorded: Recorded, group: Placed, number: int) -> Recorded:
    """Return a run where its group has put it."""
    segments = [
        Stretches(group.trajectories[Part(number, s)], stretches.surfels)
        for s, stretches in enumerate(recorded.segments)
    ]
    trajectory = joined([s.trajectory for s in segments], DT)
    estimate = replace(recorded.estimate, trajectory=trajectory)
    return replace(recorded, estimate=estimate, segments=segments)
