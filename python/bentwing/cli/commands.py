# SPDX-License-Identifier: MIT OR Apache-2.0
"""The list of commands, each imported only when it is called, so that `--help` is fast."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

# name: module, function, and what the list of commands says about it
COMMANDS = {
    "map": ("map", "map_command", "Turn a recording into a trajectory, a map and a report."),
    "localize": (
        "localize",
        "localize_command",
        "Find a recording in a map, and what has changed.",
    ),
    "merge": ("merge", "merge_command", "Put several runs into one map."),
    "info": ("info", "info", "Tell whether a recording is fit for mapping."),
    "calibrate": (
        "calibrate",
        "calibrate_command",
        "Calibrate a sensor head: the lidar on its motor, the IMU, the clocks.",
    ),
    "plan": ("plan", "plan_command", "Plan a flight: how fast to spin, what will be seen."),
    "evaluate": (
        "evaluate",
        "evaluate_command",
        "Measure the errors of a trajectory and a map.",
    ),
    "view": ("view", "view_command", "Show a run: map, path and windows over time."),
    "simulate": ("simulate", "simulate_command", "Simulate a recording with truth."),
    "reproduce": ("reproduce", "reproduce_command", "Make a paper's figures and tables again."),
}


class LazyCommands(TyperGroup):
    """Group that lists its commands from the table and loads the one that is called."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401, ARG002 - typer's signature
        """Return the names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401, ARG002
        """Return what the list of commands shows, without importing the command."""
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name][2]) if cmd_name in COMMANDS else None

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command itself."""
        name, command, rest = super().resolve_command(ctx, args)
        return name, _load(name) if name in COMMANDS else command, rest


def _load(name: str) -> Any:  # noqa: ANN401 - a command of typer's own click
    module, function, _ = COMMANDS[name]
    app = typer.Typer(add_completion=False)
    app.command(name)(getattr(import_module(f"bentwing.cli.{module}"), function))
    return typer.main.get_command(app)
