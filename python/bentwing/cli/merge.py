# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing merge`: several runs into one map."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options

EXAMPLES = (
    "bentwing merge morning noon evening -o site",
    "bentwing merge morning noon -o site --map-format e57 --map-spacing 0.02",
    "bentwing merge morning noon -o site --epsg 25832 --control-points marks.csv",
)


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN",
            help="Folders that `bentwing map` has written.",
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
    from bentwing.cli.done import say_maps
    from bentwing.closing.georeference.settings import GeoreferenceSettings
    from bentwing.map.clean import CleanSettings
    from bentwing.run.choose import given
    from bentwing.run.merging import merge

    merged = merge(
        runs,
        out,
        **given(map_format=map_format, map_spacing=map_spacing),
        georeferencing=GeoreferenceSettings(
            **given(mode=georeference, epsg=epsg, control_points=control_points)
        ),
        cleaning=CleanSettings(**options.cleaning(keep_mixed=keep_mixed, keep_moving=keep_moving)),
        project=project,
        refine=not no_refine,
        normals=normals,
        threads=threads,
        progress=create_progress(quiet=quiet),
    )
    say_maps(merged, quiet=quiet)
