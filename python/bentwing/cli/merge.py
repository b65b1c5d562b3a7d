# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing merge`: several runs into one map."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options

EXAMPLES = (
    "bentwing merge morning noon evening -o site",
    "bentwing merge morning noon -o site --map-format e57 --map-spacing 0.02",
    "bentwing merge site later -o site",
    "bentwing merge morning noon -o site --epsg 25832 --control-points marks.csv",
)


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN",
            help="Folders that `bentwing map` has written; a site of `bentwing fleet` stands for its runs.",
            rich_help_panel=options.INPUT,
        ),
    ],
    *,
    out: options.Out,
    map_format: options.Format = None,
    map_spacing: options.Spacing = None,
    keep_moving: options.KeepMoving = False,
    keep_mixed: options.KeepMixed = False,
    no_refine: options.NoRefine = False,
    normals: options.Normals = False,
    georeference: options.Georeference = None,
    epsg: options.Epsg = None,
    control_points: options.ControlPoints = None,
    project: options.Project = None,
    threads: options.Threads = None,
    quiet: options.Quiet = False,
) -> None:
    """Put several runs into one map, without a guess of their relative poses.

    Runs that have no place in common become maps of their own, in folders of their own. The GNSS fixes
    of all runs put a map on the Earth together; coordinates are those of the runs unless said otherwise.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.cli.done import say_maps, say_site
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.fleet.joining import is_site, join_site, runs_of
    from bentwing.fleet.opened import side_by_side
    from bentwing.map.clean import CleanSettings
    from bentwing.recording.sections.project import Project
    from bentwing.run.choose import given
    from bentwing.run.merging import merge

    progress = create_progress(quiet=quiet)
    cleaned = options.cleaning(keep_mixed=keep_mixed, keep_moving=keep_moving)
    on_earth = given(mode=georeference, epsg=epsg, control_points=control_points)
    if is_site(out):
        asked = given(
            map_format=map_format,
            map_spacing=map_spacing,
            georeferencing=on_earth or None,
            cleaning=cleaned or None,
            project=None if project is None else Project.load(project),
            refine=False if no_refine else None,
            normals=True if normals else None,
        )
        site = join_site(runs, out, asked, side_by_side(threads, progress), progress)
        say_site(site, quiet=quiet)
        return
    runs = runs_of(runs)
    merged = merge(
        runs,
        out,
        **given(map_format=map_format, map_spacing=map_spacing),
        georeferencing=GeoreferenceSettings(**on_earth),
        cleaning=CleanSettings(**cleaned),
        project=project,
        refine=not no_refine,
        normals=normals,
        threads=threads,
        progress=progress,
    )
    say_maps(merged, quiet=quiet)
