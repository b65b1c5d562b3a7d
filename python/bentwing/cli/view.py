# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing view`: a run in the rerun viewer."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, option
from bentwing.products.names import Viewer

EXAMPLES = (
    "bentwing view run",
    "bentwing view run --save run.rrd",
    "bentwing view run --with open3d",
    "bentwing view run --pictures pictures",
    "bentwing view run --video frames --frames 500",
)


def command(
    run: options.Run,
    *,
    viewer: Annotated[
        Viewer, option(RESULT, "--with", help="Program that shows it; each is an extra package.")
    ] = "rerun",
    save: Annotated[
        Path | None,
        options.file(
            help="Write a file instead: .rrd for rerun, or .png as Open3D draws it, without a screen.",
        ),
    ] = None,
    max_points: Annotated[
        int,
        option(RESULT, metavar="N", min=1000, help="Thin the map evenly to so many points."),
    ] = 3_000_000,
    pictures: Annotated[
        Path | None,
        options.folder(
            help="Write plan and sections as PNG into this folder instead.",
        ),
    ] = None,
    video: Annotated[
        Path | None,
        options.folder(
            help="Write the flight as frames of a video into this folder instead.",
        ),
    ] = None,
    frames: Annotated[
        int, option(RESULT, metavar="N", min=1, help="Number of frames of the video.")
    ] = 300,
    quiet: options.Quiet = False,
) -> None:
    """Show a run: the map as it grows on three levels of detail, path, surfels, windows; in Open3D map and path."""
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
    if viewer == "open3d":
        from bentwing.products.open3d_view import view_in_open3d

        view_in_open3d(run, save=save, max_points=max_points, progress=progress)
        if save is not None:
            typer.echo(save)
        return
    view_run(run, save=save, max_points=max_points, progress=progress)
    if save is not None:
        typer.echo(f"{save}: {save.stat().st_size / 1e6:.1f} MB; open it with `rerun {save}`")
