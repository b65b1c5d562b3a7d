# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing terrain`: the ground of a map."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, option

EXAMPLES = (
    "bentwing terrain run -o dtm.tif",
    "bentwing terrain run --interval 0.2 -o contours.dxf",
    "bentwing terrain run -o classified.laz",
)


def command(
    run: options.Run,
    *,
    out: Annotated[
        Path,
        options.out_file(
            "Heights as .tif; contours as .geojson, .dxf, .svg, .png or .pdf; the map with "
            "classes and heights above ground as .laz or .las."
        ),
    ],
    cell: Annotated[
        float, option(RESULT, metavar="METRES", help="Edge of a cell of the grid of heights.")
    ] = 0.25,
    interval: Annotated[
        float, option(RESULT, metavar="METRES", help="Height between two contours.")
    ] = 0.5,
    scale: Annotated[
        int | None,
        option(
            RESULT,
            metavar="N",
            help="Scale 1:N of a drawing.",
            show_default="the largest round one on A3",
        ),
    ] = None,
    quiet: options.Quiet = False,
) -> None:
    """Find the ground of a map: a terrain model, contours, or the points with their classes."""
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.products.terrain import write_terrain

    found = write_terrain(
        run, out, cell=cell, interval=interval, scale=scale, progress=create_progress(quiet=quiet)
    )
    if not quiet:
        typer.echo(f"{out}: {found.sentence()}")
