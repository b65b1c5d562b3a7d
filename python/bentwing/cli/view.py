# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing view`: a run in the rerun viewer."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

Option = typer.Option


def view_command(
    run: Annotated[Path, typer.Argument(help="Folder that `bentwing map` has written.")],
    save: Annotated[
        Path | None, Option(help="Write a .rrd file instead of opening it.", show_default=False)
    ] = None,
    max_points: Annotated[
        int, Option(min=1000, help="Shown of the map; a larger one is thinned evenly.")
    ] = 3_000_000,
    *,
    quiet: Annotated[bool, Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Show a run in rerun: the map as it grows on three levels of detail, path, surfels, windows."""
    from bentwing.progress import create_progress
    from bentwing.view import view_run

    view_run(run, save=save, max_points=max_points, progress=create_progress(quiet=quiet))
    if save is not None:
        typer.echo(f"{save}: {save.stat().st_size / 1e6:.1f} MB; open it with `rerun {save}`")
