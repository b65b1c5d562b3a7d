# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing mesh`: the surface of a map as triangles."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, option
from bentwing.products.names import MeshColour

EXAMPLES = (
    "bentwing mesh run -o mesh.ply",
    "bentwing mesh run --spacing 0.1 --colour intensity -o mesh.glb",
)


def command(
    run: options.Run,
    *,
    out: Annotated[
        Path,
        options.out_file("Triangles as .ply, .obj or .glb."),
    ],
    spacing: Annotated[
        float,
        option(
            RESULT,
            metavar="METRES",
            help="Edge of the voxels that give one point each, and about that of the triangles.",
        ),
    ] = 0.05,
    colour: Annotated[
        MeshColour, option(RESULT, help="What the colours of the vertices show.")
    ] = "height",
    quiet: options.Quiet = False,
) -> None:
    """Fit a surface to the points of a map, as triangles."""
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.products.mesh import write_mesh

    found = write_mesh(
        run, out, spacing=spacing, colour=colour, progress=create_progress(quiet=quiet)
    )
    if not quiet:
        typer.echo(f"{out}: {found.sentence()}")
