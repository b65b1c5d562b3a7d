# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing volume`: how much there is of a pile, or how much is missing of a pit."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import INPUT, RESULT, option

EXAMPLES = (
    "bentwing volume run --area pile.geojson",
    "bentwing volume after --base before --area pit.geojson",
    "bentwing volume run --base dtm --area pile.geojson --json > volume.json",
)


def command(
    run: options.Run,
    *,
    area: Annotated[
        Path,
        option(INPUT, metavar="FILE", help="Polygon as GeoJSON, in the coordinates of the map."),
    ],
    base: Annotated[
        str,
        option(
            INPUT,
            metavar="BASE",
            help="What is measured against: plane and dtm, of what lies around the area, or the "
            "folder of another run.",
        ),
    ] = "plane",
    cell: Annotated[
        float, option(RESULT, metavar="METRES", help="Edge of a cell of the surfaces.")
    ] = 0.1,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Measure the volume between a surface of a map and a base, with its uncertainty."""
    # slow to import, so only when it is needed
    import json

    from bentwing.base.plain import plain
    from bentwing.base.progress import create_progress
    from bentwing.products.volume import measure_volume

    found = measure_volume(
        run, area, base=base, cell=cell, progress=create_progress(quiet=quiet or as_json)
    )
    typer.echo(json.dumps(plain(found), indent=1) if as_json else found.sentence())
