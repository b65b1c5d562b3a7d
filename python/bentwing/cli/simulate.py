# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing simulate`: a recording with truth."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from pydantic import ValidationError
from rich.console import Console
from rich.progress import Progress

from bentwing.errors import UsageError
from bentwing.simulate import Scenario, simulate

Option = typer.Option


def simulate_command(
    scenario: Annotated[str, typer.Argument(help="courtyard or office", show_default=False)],
    out: Annotated[Path, Option("--output", "-o", help="Folder to write into.")],
    head: Annotated[str, Option(help="hokuyo-spin")] = "hokuyo-spin",
    duration: Annotated[float, Option(help="Length of the recording, s.")] = 60.0,
    seed: Annotated[int, Option(help="Varies geometry, motion and noise.")] = 0,
    format: Annotated[str, Option(help="bag (ROS 1), mcap or db3 (ROS 2).")] = "bag",  # noqa: A002
    max_range: Annotated[float | None, Option(help="Lidar sees up to here, m.")] = None,
) -> None:
    """Simulate a recording with truth: bag, payload.yaml, trajectory, scene and calibration."""
    choices = {
        "scene": scenario,
        "head": head,
        "duration": duration,
        "seed": seed,
        "format": format,
        "max_range": max_range,
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
