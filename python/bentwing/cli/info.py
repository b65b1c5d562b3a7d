# SPDX-License-Identifier: MIT OR Apache-2.0
"""The command `bentwing info`: is this recording fit for mapping."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer
from rich.console import Console

from bentwing.calibrate.inspection import inspect
from bentwing.cli.info_page import page


def info(
    recording: Annotated[
        list[Path],
        typer.Argument(
            help="ROS 1 .bag, ROS 2 bag folder, .db3, .mcap or .pcap; several parts of one."
        ),
    ],
    payload: Annotated[
        Path | None, typer.Option("--payload", "-p", help="payload.yaml of the sensor head.")
    ] = None,
    *,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print one JSON object instead of the page.")
    ] = False,
) -> None:
    """Tell topics, rates, gaps, spin, stalls and visible structure, and whether mapping can work."""
    inspection = inspect(recording, payload)
    if as_json:
        typer.echo(json.dumps({**dataclasses.asdict(inspection), "is_fit": inspection.is_fit}))
        return
    console = Console()
    for part in page(inspection):
        console.print(part)
