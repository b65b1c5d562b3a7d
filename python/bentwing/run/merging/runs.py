# SPDX-License-Identifier: MIT OR Apache-2.0
"""Several runs into one map, or into as many as have nothing in common: the room on one screen."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.base.progress import Progress, as_progress
from bentwing.base.regular_file import resolved
from bentwing.closing.georeference.settings import GeoreferenceSettings
from bentwing.closing.global_registration import Budget
from bentwing.closing.global_registration.stretches import length_of
from bentwing.closing.joining.describe import describe_matches, describe_parts_of
from bentwing.closing.joining.matches import Part, find_matches, parts_of
from bentwing.closing.joining.placing import place_groups
from bentwing.closing.joining.survey import Survey, survey
from bentwing.map.clean import CleanSettings
from bentwing.recording.sections.project import as_project
from bentwing.run.check import require_coordinates, require_effect
from bentwing.run.folder import RunFolder
from bentwing.run.found import Found
from bentwing.run.merging.maps import Ingredients, MergedMap, make_maps
from bentwing.run.merging.on_earth import require_places, settings_of_runs
from bentwing.run.merging.source import Source, open_sources
from bentwing.run.settings import merge_settings

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence
    from contextlib import AbstractContextManager

    from bentwing.closing.joining.placing import Placed
    from bentwing.recording.sections.project import Project
    from bentwing.run.merging.comparisons import Comparisons
    from bentwing.run.settings import MergeSettings


@dataclass(frozen=True, slots=True)
class Merged:
    """Several runs, merged.

    Attributes
    ----------
    out : the folder
    maps : one, or more where runs have no place in common
    record : what run.json says about the merging
    """

    out: Path
    maps: list[MergedMap]
    record: Mapping[str, Any]


def merge(
    runs: Sequence[Path | str],
    out: Path | str,
    *,
    map_format: str = "laz",
    map_spacing: float = 0.0,
    cleaning: CleanSettings | None = None,
    refine: bool = True,
    normals: bool = False,
    georeferencing: GeoreferenceSettings | None = None,
    project: Project | Path | str | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Merged:
    """Merge runs into one map, without a guess of their relative poses.

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
    cleaning : what is left out of the map; default: mixed pixels and what moved, while a run was
        flown or between the runs
    refine : whether points are moved along their beams to the surface that they measured together
    normals : whether points have the normal of their surface, towards the lidar
    georeferencing : how the GNSS fixes of all runs and control points are used; what is not given is
        as in the runs, where they agree
    project : what the first page of the report names, or a YAML file of it; default: the first run's
    threads : default: all cores
    progress : what to tell the user meanwhile; default: nothing

    Raises
    ------
    UsageError, InputError, EstimationError
    """
    settings = merge_settings(
        map_format=map_format,
        map_spacing=map_spacing,
        cleaning=cleaning or CleanSettings(),
        refine=refine,
        normals=normals,
        georeferencing=georeferencing or GeoreferenceSettings(),
        project=as_project(project),
        threads=threads,
        runs=[resolved(Path(run)) for run in runs],
    )
    require_coordinates(settings.georeferencing)
    require_places(settings.georeferencing)
    sources = open_sources([Path(run) for run in runs])
    settings = settled(settings, sources)
    if any(resolved(Path(out)) == resolved(source.folder) for source in sources):
        msg = (
            f"{out}: is one of the runs that are to be merged; choose another folder for the result"
        )
        raise UsageError(msg)
    with RunFolder(Path(out), settings.to_json()) as folder:
        return merge_into(folder, sources, settings, as_progress(progress))


def settled(settings: MergeSettings, sources: Sequence[Source]) -> MergeSettings:
    """Return the settings of a merging with what its runs agree on, where it was not given.

    Raises
    ------
    UsageError
        If coordinates are asked for that nothing in the runs can give.
    """
    wanted = settings_of_runs(settings.georeferencing, sources)
    named = settings.project or next((s.project for s in sources if s.project is not None), None)
    is_placed = any(
        source.payload.gnss is not None or source.georeferencing.fixes is not None
        for source in sources
    )
    require_effect(wanted, "these runs", is_placed=is_placed)
    return settings.model_copy(update={"georeferencing": wanted, "project": named})


def merge_into(
    folder: RunFolder,
    sources: list[Source],
    settings: MergeSettings,
    progress: Progress,
    said: Collection[str] = (),
) -> Merged:
    """Merge opened runs into a folder that is open, too; see `merge`.

    Parameters
    ----------
    said : names of the runs whose warnings the user has been told of already
    """
    with folder.stage("inputs"):
        folder.add_inputs([path for source in sources for path in source.recordings])
    groups, found = find_groups(sources, settings, progress, folder.stage)
    folder.record.found = Found(merging={**found.record, "maps": []})
    folder.save()
    told = {warning for source in sources if source.name in said for warning in source.told}
    maps = make_maps(folder, groups, replace(found, said=told))
    return Merged(folder.path, maps, folder.record.found.merging or {})


def find_groups(
    sources: list[Source],
    settings: MergeSettings,
    progress: Progress,
    stage: Callable[[str], AbstractContextManager[None]],
    kept: Comparisons | None = None,
) -> tuple[list[Placed], Ingredients]:
    """Find which runs have places in common, and where these put them.

    Parameters
    ----------
    stage : called with the name of each step, times it
    kept : what an earlier merging has found, and where that of this one is kept

    Returns
    -------
    The groups of runs, and what their maps are made of.
    """
    with stage("survey"):
        surveys = _surveyed(sources, settings, progress, kept)
    parts = parts_of(surveys)
    with stage("match"), progress.stage("match", _n_pairs(len(parts)), "pairs") as shown:
        matches = find_matches(parts, shown, None if kept is None else kept.of(sources, parts))
    trajectories = {
        Part(r, s): stretches.trajectory
        for r, one in enumerate(surveys)
        for s, stretches in enumerate(one.recorded.segments)
    }
    ties = [(part, Part(part.run, part.segment + 1)) for part in parts]
    with stage("place"):
        groups, matches = place_groups(
            trajectories, parts, matches, [tie for tie in ties if tie[1] in parts]
        )
    names = [source.name for source in sources]
    record = {
        "parts": describe_parts_of(names, parts),
        "candidates": describe_matches(names, matches),
    }
    return groups, Ingredients(sources, surveys, matches, record, settings, progress)


def _n_pairs(n: int) -> float:
    return n * (n - 1) / 2


def budget_of(sources: Sequence[Source], settings: MergeSettings) -> Budget:
    """Return what the registration of all runs holds in memory; it decides how dense their surfels are."""
    seconds = sum(length_of(source.estimate) for source in sources)
    return Budget.of(seconds, settings.loop_closure)


def _surveyed(
    sources: Sequence[Source],
    settings: MergeSettings,
    progress: Progress,
    kept: Comparisons | None,
) -> list[Survey]:
    budget = budget_of(sources, settings)
    progress.note(f"merging: {budget.sentence()}")

    def survey_of(source: Source) -> Survey:
        with source.part() as part, progress.stage(f"survey {source.name}", part.length) as shown:
            return survey(
                source.name,
                source.estimate,
                part.batches(shown, Counter()),
                source.payload,
                surfel_rate=budget.rate,
                settings=settings.loop_closure,
                threads=settings.threads,
            )

    if kept is None:
        return [survey_of(source) for source in sources]
    return [kept.survey(source, budget.rate, settings, survey_of) for source in sources]
