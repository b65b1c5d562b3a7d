# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing localize`: a recording in a map that is already there."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer


def localize_command(
    recording: Annotated[list[Path], typer.Argument(help="Recording, or its consecutive parts.")],
    *,
    prior_map: Annotated[
        Path,
        typer.Option("--map", help="Run folder, or a .laz, .las, .ply, .pcd or .e57 file."),
    ],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write into.")],
    payload: Annotated[
        Path | None, typer.Option(help="payload.yaml, the description of the sensor head.")
    ] = None,
    estimator: Annotated[str, typer.Option(help="continuous, kalman or ndt.")] = "continuous",
    map_format: Annotated[str, typer.Option(help="laz, las, ply, pcd or e57.")] = "laz",
    map_spacing: Annotated[
        float, typer.Option(help="Keep one point per voxel of this edge in metres; 0 keeps all.")
    ] = 0.0,
    threads: Annotated[int | None, typer.Option(help="Default: all cores.", min=1)] = None,
    start: Annotated[
        float | None, typer.Option(help="Seconds to skip at the start.", min=0)
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Seconds of the recording to use.", min=0)
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Go on with the run in OUT that was killed.")
    ] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")] = False,
) -> None:
    """Find a recording in a map without a guess, and tell what has changed.

    Writes what `bentwing map` does, in the frame of the map, and the points that have appeared and
    disappeared since.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.run.pipeline import run_recording
    from bentwing.run.settings import as_run_settings

    settings = as_run_settings(
        estimator=estimator,
        payload=payload,
        settings=None,
        map_format=map_format,
        map_spacing=map_spacing,
        prior_map=prior_map,
        threads=threads,
        start=start,
        duration=duration,
    )
    progress = create_progress(quiet=quiet)
    run_recording(recording, out, settings, payload, resume=resume, progress=progress)
    if not quiet:
        typer.echo(f"{out}: open {out / 'report.html'}")
