# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing plan`: how fast to spin a head, and what comes of it."""

from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import INPUT, option
from bentwing.recording.ready import payload_path

EXAMPLES = (
    "bentwing plan payload.yaml",
    "bentwing plan payload.yaml --distance 10 --speed 3 --picture sphere.svg",
)


def command(  # noqa: PLR0917 - one parameter per option
    payload: Annotated[
        Path,
        typer.Argument(
            metavar="FILE",
            help="Description of the sensor head: payload.yaml, or dataset:NAME of `bentwing payload list`.",
            rich_help_panel=INPUT,
            parser=payload_path,
        ),
    ],
    distance: Annotated[
        float, option(INPUT, metavar="METRES", help="Distance from the structure.")
    ] = 5.0,
    speed: Annotated[float, option(INPUT, metavar="M/S", help="Speed of the carrier.")] = 2.0,
    voxel_size: Annotated[
        float, option(INPUT, metavar="METRES", help="Edge of the finest voxels.")
    ] = 0.4,
    window: Annotated[
        float, option(INPUT, metavar="SECONDS", help="Length of the estimator's window.")
    ] = 5.0,
    scan_rate: Annotated[
        float | None,
        option(INPUT, metavar="HZ", help="Sweeps per second.", show_default="of the lidar's kind"),
    ] = None,
    beam_step: Annotated[
        float | None,
        option(
            INPUT,
            metavar="DEGREES",
            help="Angle between beams.",
            show_default="of the lidar's kind",
        ),
    ] = None,
    area: Annotated[float, option(INPUT, metavar="M²", help="Size of the site.")] = 2500.0,
    flight_time: Annotated[
        float, option(INPUT, metavar="MINUTES", help="Flight time of one battery.")
    ] = 10.0,
    picture: Annotated[
        Path | None,
        options.file(help="Write a map of what the head sees as SVG."),
    ] = None,
    *,
    as_json: options.Json = False,
) -> None:
    """Compute acceptable spin rates, point spacing, coverage and flight time for this head."""
    # slow to import, so only when it is needed
    import json
    import math

    from rich.console import Console

    from bentwing.base.atomic import write_text
    from bentwing.cli.plan_page import as_record, page
    from bentwing.flight.plan import Intent, plan_flight

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
