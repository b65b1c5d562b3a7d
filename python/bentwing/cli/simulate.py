# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing simulate`: a recording with truth."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated, get_args

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.progress import Progress

from bentwing.base.errors import UsageError
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.events import EventName
from bentwing.simulate.scenario import FlightName, HeadName, SceneName

Option = typer.Option


def _names(choices: object) -> str:
    return ", ".join(get_args(choices))


def simulate_command(  # noqa: PLR0917 - one parameter per option
    scenario: Annotated[str, typer.Argument(help=f"One of {_names(SceneName)}.")],
    out: Annotated[Path, Option("--output", "-o", help="Folder to write into.")],
    head: Annotated[
        str | None,
        Option(
            help=f"One of {_names(HeadName)}.",
            show_default="hokuyo-spin; town, walls, dam: vlp16-motor",
        ),
    ] = None,
    duration: Annotated[float, Option(help="Length of the recording, s.")] = 60.0,
    seed: Annotated[int, Option(help="Varies geometry, motion, calibration and noise.")] = 0,
    flight_seed: Annotated[
        int | None,
        Option(help="Varies all but the geometry: another flight in the world of --seed."),
    ] = None,
    bag_format: Annotated[
        str, Option("--format", help="bag (ROS 1), or mcap or db3 (ROS 2).")
    ] = "bag",
    motor_rate: Annotated[float, Option(help="Rate of vlp16-motor, rad/s.")] = 1.0,
    spin: Annotated[
        str, Option(help="Of hokuyo-spin: steady, or plant (downdraft, vanes and controller).")
    ] = "steady",
    max_range: Annotated[
        float | None, Option(help="The lidar sees up to here, m.", show_default="the sensor's")
    ] = None,
    speed: Annotated[
        float | None, Option(help="Of a tour, about, m/s.", show_default="the scene's")
    ] = None,
    flight: Annotated[
        str | None,
        Option(help=f"One of {_names(FlightName)}.", show_default="survey where there is no tour"),
    ] = None,
    gnss: Annotated[
        str | None, Option(help="A receiver: rtk or single.", show_default="none")
    ] = None,
    event: Annotated[
        list[str] | None, Option(help=f"Repeatable: {_names(EventName)}.", show_default=False)
    ] = None,
    stall: Annotated[float, Option(help="How long the head stands still in spin-stall, s.")] = 4.0,
    *,
    calibrated: Annotated[
        bool, Option("--calibrated", help="The payload is exact, the clocks agree.")
    ] = False,
) -> None:
    """Simulate a recording with truth: bag, payload.yaml, trajectory, scene and calibration."""
    choices: dict[str, object] = {
        "scene": scenario,
        "head": head,
        "duration": duration,
        "seed": seed,
        "flight_seed": flight_seed,
        "format": bag_format,
        "motor_rate": motor_rate,
        "spin": spin,
        "max_range": max_range,
        "events": event or (),
        "stall": stall,
        "speed": speed,
        "flight": flight,
        "gnss": gnss,
        "calibrated": calibrated,
    }
    _run(_scenario(choices), out)


def _scenario(choices: dict[str, object]) -> Scenario:
    try:
        return Scenario.model_validate(choices)
    except ValidationError as error:
        wrong = "; ".join(
            f"{'.'.join(map(str, e['loc']))}: {e['msg']}, got {e['input']!r}"
            for e in error.errors()
        )
        msg = f"this cannot be simulated: {wrong}"
        raise UsageError(msg) from error


def _run(scenario: Scenario, out: Path) -> None:
    console = Console()
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"simulating {scenario.scene}", total=scenario.duration)
        files = simulate(scenario, out, lambda time: bar.update(task, completed=time))
    console.print(f"recording  {files.recording}", highlight=False, soft_wrap=True)
    console.print(f"payload    {files.payload}", highlight=False, soft_wrap=True)
    console.print(f"truth      {files.trajectory}", highlight=False, soft_wrap=True)
