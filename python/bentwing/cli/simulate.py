# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing simulate`: a recording with truth."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, enumeration, option
from bentwing.simulate.names import (
    EventName,
    FaultName,
    FlightName,
    HeadName,
    RealismGroup,
    ReceiverName,
    RecordingFormat,
    SceneName,
    SpinName,
)

if TYPE_CHECKING:
    from enum import Enum as Event
    from enum import Enum as Fault
    from enum import Enum as Group

    from bentwing.simulate import Scenario
else:
    Event = enumeration("Event", get_args(EventName))
    Fault = enumeration("Fault", get_args(FaultName))
    Group = enumeration("Group", get_args(RealismGroup))


EXAMPLES = (
    "bentwing simulate courtyard -o recording --duration 30",
    "bentwing simulate office --head vlp16-motor --flight stand -o stand",
    "bentwing simulate town --gnss rtk --format mcap -o town",
    "bentwing simulate courtyard --seed 4 --flight-seed 8 --boxes 3 -o later",
    "bentwing simulate office --event spin-stall --stall 10 -o stall",
    "bentwing simulate office --fault gyro-degrees -o degrees",
    "bentwing simulate courtyard --realism 3 --realism-only stamps -o late",
)

WORLD = "World and flight"
HEAD = "Sensor head"
TROUBLE = "Errors"


def command(
    scenario: Annotated[
        SceneName,
        typer.Argument(
            metavar="SCENARIO",
            help=f"World to fly in: {', '.join(get_args(SceneName))}.",
            rich_help_panel=WORLD,
        ),
    ],
    *,
    out: Annotated[Path, options.out("--output")],
    duration: Annotated[
        float, option(WORLD, metavar="SECONDS", help="Length of the recording.")
    ] = 60.0,
    seed: Annotated[
        int,
        option(WORLD, metavar="N", help="Seed of geometry, motion, calibration and noise."),
    ] = 0,
    flight_seed: Annotated[
        int | None,
        option(
            WORLD,
            metavar="N",
            help="Seed of all but the geometry: another flight in the world of --seed.",
        ),
    ] = None,
    boxes: Annotated[
        int,
        option(
            WORLD,
            metavar="N",
            help="Boxes on the ground, elsewhere in every flight of the world: another day.",
        ),
    ] = 0,
    spheres: Annotated[
        int,
        option(WORLD, metavar="N", help="Spheres of 0.1 m radius on posts, as control marks."),
    ] = 0,
    things_seed: Annotated[
        int | None,
        option(
            WORLD,
            metavar="N",
            help="Seed of what stands in courtyard, office, carpark: a storey built alike.",
        ),
    ] = None,
    flight: Annotated[
        FlightName | None,
        option(
            WORLD, help="Kind of flight.", show_default="tour; walls, dam: survey; street: drive"
        ),
    ] = None,
    speed: Annotated[
        float | None,
        option(
            WORLD,
            metavar="M/S",
            help="Approximate speed of a tour or drive.",
            show_default="the scene's",
        ),
    ] = None,
    head: Annotated[
        HeadName | None,
        option(
            HEAD,
            help="Sensor head, and how it is moved.",
            show_default="hokuyo-spin; town, walls, dam: vlp16-motor; street: hdl64",
        ),
    ] = None,
    motor_rate: Annotated[float, option(HEAD, metavar="RAD/S", help="Rate of vlp16-motor.")] = 1.0,
    spin: Annotated[
        SpinName,
        option(HEAD, help="Spin of hokuyo-spin; plant simulates downdraft, vanes and controller."),
    ] = "steady",
    max_range: Annotated[
        float | None,
        option(HEAD, metavar="METRES", help="Reach of the lidar.", show_default="the sensor's"),
    ] = None,
    gnss: Annotated[
        ReceiverName | None, option(HEAD, help="Add a GNSS receiver.", show_default="none")
    ] = None,
    event: Annotated[
        list[Event],
        option(
            TROUBLE,
            "--event",
            metavar="NAME",
            help=f"What goes wrong, repeatable: {', '.join(get_args(EventName))}.",
            show_default=False,
        ),
    ] = [],  # noqa: B006 - typer reads it and hands out a copy
    stall: Annotated[
        float,
        option(TROUBLE, metavar="SECONDS", help="How long the head stands still in spin-stall."),
    ] = 4.0,
    fault: Annotated[
        Fault | None,
        option(
            TROUBLE,
            metavar="NAME",
            help=f"What is wrongly set up: {', '.join(get_args(FaultName))}.",
            show_default="none",
        ),
    ] = None,
    calibrated: Annotated[
        bool, option(TROUBLE, "--calibrated", help="The payload is exact, the clocks agree.")
    ] = False,
    realism: Annotated[
        float,
        option(
            TROUBLE,
            metavar="0|1|3",
            help="What real sensors do beyond noise: 0 nothing, 1 as usual, 3 three times that.",
        ),
    ] = 0.0,
    realism_only: Annotated[
        list[Group],
        option(
            TROUBLE,
            "--realism-only",
            metavar="GROUP",
            help=f"Only this group of it, repeatable: {', '.join(get_args(RealismGroup))}.",
            show_default=False,
        ),
    ] = [],  # noqa: B006 - typer reads it and hands out a copy
    bag_format: Annotated[
        RecordingFormat,
        option(
            RESULT,
            "--format",
            help="Format of the recording: bag for ROS 1, mcap and db3 for ROS 2.",
        ),
    ] = "bag",
    quiet: options.Quiet = False,
) -> None:
    """Simulate a recording with truth: bag, payload.yaml, trajectory, scene and calibration."""
    choices: dict[str, object] = {
        "scene": scenario,
        "head": head,
        "duration": duration,
        "seed": seed,
        "flight_seed": flight_seed,
        "boxes": boxes,
        "spheres": spheres,
        "things_seed": things_seed,
        "format": bag_format,
        "motor_rate": motor_rate,
        "spin": spin,
        "max_range": max_range,
        "events": [one.value for one in event],
        "stall": stall,
        "speed": speed,
        "flight": flight,
        "gnss": gnss,
        "calibrated": calibrated,
        "realism": realism,
        "realism_only": [one.value for one in realism_only],
    }
    _run(_scenario(choices), None if fault is None else fault.value, out, quiet=quiet)


def _scenario(choices: dict[str, object]) -> "Scenario":
    # slow to import, so only when it is needed
    from pydantic import ValidationError

    from bentwing.base.errors import UsageError
    from bentwing.base.validation import describe
    from bentwing.simulate import Scenario

    try:
        return Scenario.model_validate(choices)
    except ValidationError as error:
        raise UsageError(describe(error, Scenario, "this cannot be simulated")) from None


def _run(scenario: "Scenario", fault: str | None, out: Path, *, quiet: bool) -> None:
    from rich.console import Console
    from rich.progress import Progress

    from bentwing.simulate import simulate
    from bentwing.simulate.faults.simulation import simulate_with_fault

    console = Console(quiet=quiet)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(f"simulating {scenario.scene}", total=scenario.duration)

        def show(time: float) -> None:
            bar.update(task, completed=time)

        if fault is None:
            files = simulate(scenario, out, show)
        else:
            files = simulate_with_fault(scenario, fault, out, show)
    console.print(f"recording  {files.recording}", highlight=False, soft_wrap=True)
    console.print(f"payload    {files.payload}", highlight=False, soft_wrap=True)
    console.print(f"truth      {files.trajectory}", highlight=False, soft_wrap=True)
