# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing payload`: a description of the sensor head to start from."""

from pathlib import Path
from typing import Annotated, Literal

import typer

from bentwing.cli import options

EXAMPLES = (
    "bentwing payload init recording.bag",
    "bentwing payload init recording.bag -o head.yaml",
)


def command(
    action: Annotated[
        Literal["init"],
        typer.Argument(
            metavar="ACTION",
            help="What to do: init writes what a recording tells of its head.",
            rich_help_panel=options.INPUT,
        ),
    ],
    recording: options.Recording,
    *,
    out: Annotated[
        Path,
        options.option(
            options.RESULT,
            "--out",
            "-o",
            metavar="FILE",
            help="Write this file; it must not exist.",
        ),
    ] = Path("payload.yaml"),
    quiet: options.Quiet = False,
) -> None:
    """Write a payload.yaml to start from: topics, lidar, IMU and encoder of a recording."""
    # slow to import, so only when it is needed
    from bentwing.base.new_file import require_new
    from bentwing.calibrate.draft import draft_payload

    del action  # there is one
    require_new(out)
    draft = draft_payload(recording)
    draft.save(out)
    if not quiet:
        typer.echo(draft.to_yaml())
        typer.echo(f"{out}: written; answer what stands behind #, then `bentwing info`")
