# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing view`: a run in the rerun viewer."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

Option = typer.Option


def view_command(  # noqa: PLR0917 - one parameter per option
    run: Annotated[Path, typer.Argument(help="Folder that `bentwing map` has written.")],
    save: Annotated[
        Path | None, Option(help="Write a .rrd file instead of opening it.", show_default=False)
    ] = None,
    max_points: Annotated[
        int, Option(min=1000, help="Shown of the map; a larger one is thinned evenly.")
    ] = 3_000_000,
    pictures: Annotated[
        Path | None,
        Option(help="Write plan and sections as PNG into this folder instead.", show_default=False),
    ] = None,
    video: Annotated[
        Path | None,
        Option(help="Write the flight as frames of a video instead.", show_default=False),
    ] = None,
    frames: Annotated[int, Option(min=1, help="Of the video.")] = 300,
    *,
    quiet: Annotated[bool, Option("--quiet", "-q", help="No progress.")] = False,
) -> None:
    """Show a run in rerun: the map as it grows on three levels of detail, path, surfels, windows."""
    from bentwing.base.progress import create_progress
    from bentwing.report.view import view_run, write_frames, write_pictures

    progress = create_progress(quiet=quiet)
    if pictures is not None:
        for path in write_pictures(run, pictures, progress):
            typer.echo(path)
    if video is not None:
        written = write_frames(run, video, frames, progress)
        typer.echo(
            f"{video}: {len(written)} frames; `ffmpeg -r 25 -i {video}/frame_%04d.png flight.mp4`"
        )
    if pictures is not None or video is not None:
        return
    view_run(run, save=save, max_points=max_points, progress=progress)
    if save is not None:
        typer.echo(f"{save}: {save.stat().st_size / 1e6:.1f} MB; open it with `rerun {save}`")
