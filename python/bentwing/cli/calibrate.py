# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing calibrate`: the transforms and clocks of a sensor head."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options

EXAMPLES = (
    "bentwing calibrate recording.bag -p payload.yaml -o calibration",
    "bentwing calibrate recording.bag -p payload.yaml -o calibration --start 10 --duration 30",
)


def command(
    recording: options.Recording,
    *,
    out: options.Out,
    payload: Annotated[Path, options.payload()],
    threads: options.Threads = None,
    start: options.Start = None,
    duration: options.Duration = None,
    quiet: options.Quiet = False,
) -> None:
    """Calibrate a sensor head: payload.yaml with standard deviations, and a wall before and after.

    A motor-turned lidar needs one revolution at a constant rate with the carrier at rest in any room;
    the mount of the IMU and the latency need motion.
    """
    # slow to import, so only when it is needed
    from rich.console import Console

    from bentwing.base.progress import create_progress
    from bentwing.calibrate import calibrate
    from bentwing.calibrate.folder import CalibrationFolder
    from bentwing.cli.calibrate_page import page
    from bentwing.report import draw_wall

    with CalibrationFolder(out, [*recording, payload]) as folder:
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
