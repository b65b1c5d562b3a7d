# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing calibrate`: the transforms and clocks of a sensor head."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer


def calibrate_command(  # noqa: PLR0917 - one parameter per option
    recording: Annotated[list[Path], typer.Argument(help="Recording, or its consecutive parts.")],
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write into.")],
    payload: Annotated[
        Path, typer.Option(help="payload.yaml, the description of the sensor head.")
    ],
    threads: Annotated[int | None, typer.Option(help="Default: all cores.", min=1)] = None,
    start: Annotated[
        float | None, typer.Option(help="Seconds to skip at the start.", min=0)
    ] = None,
    duration: Annotated[
        float | None, typer.Option(help="Seconds of the recording to use.", min=0)
    ] = None,
    *,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")] = False,
) -> None:
    """Calibrate a sensor head: payload.yaml with standard deviations, and a wall before and after.

    A motor-turned lidar needs one revolution at a constant rate with the carrier at rest in any room;
    the IMU's mount and the latency are seen in motion.
    """
    # slow to import, so only when it is needed
    from rich.console import Console

    from bentwing.base.progress import create_progress
    from bentwing.calibrate import calibrate
    from bentwing.calibrate.folder import CalibrationFolder
    from bentwing.cli.calibration_page import page
    from bentwing.report import draw_wall

    folder = CalibrationFolder(out)
    found = calibrate(
        recording,
        payload,
        start=start,
        duration=duration,
        threads=threads,
        progress=create_progress(quiet=quiet),
    )
    if (wall := found.wall) is not None:
        draw_wall(folder.file("wall.png"), wall.along, wall.across, wall.halves, wall.gaps)
    folder.finish(found, [*recording, payload])
    if quiet:
        return
    console = Console()
    for part_of_page in page(found):
        console.print(part_of_page, highlight=False)
    typer.echo(f"{out}: payload.yaml and calibration.json")
