# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing plan`: how fast to spin a head, and what comes of it."""

from __future__ import annotations

import json
import math
from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer
from rich.console import Console

from bentwing.base.atomic import write_text
from bentwing.cli.plan_page import as_record, page
from bentwing.flight.plan import Intent, plan_flight

Option = typer.Option


def plan_command(  # noqa: PLR0917 - one parameter per option
    payload: Annotated[Path, typer.Argument(help="payload.yaml of the sensor head.")],
    distance: Annotated[float, Option(help="To the structure, m.")] = 5.0,
    speed: Annotated[float, Option(help="Of the carrier, m/s.")] = 2.0,
    voxel_size: Annotated[float, Option(help="Of the finest surfels, m.")] = 0.4,
    window: Annotated[float, Option(help="Of the estimator, s.")] = 5.0,
    scan_rate: Annotated[
        float | None, Option(help="Sweeps per second.", show_default="of the lidar's kind")
    ] = None,
    beam_step: Annotated[
        float | None, Option(help="Between beams, °.", show_default="of the lidar's kind")
    ] = None,
    area: Annotated[float, Option(help="Of the site, m².")] = 2500.0,
    flight_time: Annotated[float, Option(help="Of one battery, min.")] = 10.0,
    picture: Annotated[
        Path | None, Option(help="Write the map of the sphere as SVG.", show_default=False)
    ] = None,
    *,
    as_json: Annotated[bool, Option("--json", help="Print one JSON object instead.")] = False,
) -> None:
    """Tell acceptable spin rates, point spacing, coverage and flight time for this head."""
    intent = Intent(
        distance=distance,
        speed=speed,
        voxel_size=voxel_size,
        window=window,
        scan_rate_hz=scan_rate,
        beam_step=None if beam_step is None else math.radians(beam_step),
        area=area,
        flight_time=60.0 * flight_time,
    )
    plan = plan_flight(payload, intent)
    if picture is not None:
        from bentwing.report.sphere import sphere_map

        write_text(picture, sphere_map(plan.coverage.seen, "What the head sees of the sphere"))
    if as_json:
        typer.echo(json.dumps(as_record(plan)))
        return
    console = Console()
    for part in page(plan):
        console.print(part, highlight=False)
