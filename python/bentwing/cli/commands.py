# SPDX-License-Identifier: MIT OR Apache-2.0
"""The list of commands, each imported only when it is called, so that `--help` is fast."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from bentwing.cli.command import CONTEXT, Command, closing
from bentwing.cli.mistakes import did_you_mean

# What the list of commands says about each; the command is `bentwing.cli.<name>.command`.
COMMANDS = {
    "map": "Turn a recording into a trajectory, a map and a report.",
    "localize": "Find a recording in a map, and report what has changed.",
    "fleet": "Map many recordings on a cluster, and merge them.",
    "merge": "Put several runs into one map.",
    "export": "Write a run's map or trajectory in another form.",
    "info": "Check whether a recording is fit for mapping.",
    "live": "Run odometry live, among the topics of ROS 2.",
    "payload": "Write a payload.yaml to start from, or list ready ones.",
    "calibrate": "Calibrate a sensor head: motor, IMU and clocks.",
    "plan": "Plan a flight: spin rate, point spacing, coverage.",
    "evaluate": "Measure the errors of a trajectory and a map.",
    "report": "Draw the report of a run again, and print it.",
    "section": "Draw a plan or section of a map, with its walls.",
    "terrain": "Find the ground: heights, contours, classes of points.",
    "volume": "Measure a volume over an area, with its uncertainty.",
    "mesh": "Fit triangles to the points of a map.",
    "view": "Show a run: map, path and windows over time.",
    "simulate": "Simulate a recording with truth.",
    "reproduce": "Make a paper's figures and tables again.",
}


class LazyCommands(TyperGroup):
    """Group that lists its commands from the table and loads the one that is called."""

    def list_commands(self, ctx: Any) -> list[str]:  # noqa: ANN401, ARG002 - typer's signature
        """Return the names in the order of the table."""
        return list(COMMANDS)

    def get_command(self, ctx: Any, cmd_name: str) -> Any:  # noqa: ANN401, ARG002
        """Return what the list of commands shows, without importing the command."""
        return TyperCommand(cmd_name, help=COMMANDS[cmd_name]) if cmd_name in COMMANDS else None

    def format_epilog(self, ctx: Any, formatter: Any) -> None:  # noqa: ANN401, ARG002
        """Write examples and exit codes, line by line."""
        formatter.write(self.epilog)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:  # noqa: ANN401
        """Return the command itself."""
        name, *rest = args
        if name in COMMANDS:
            return name, load(name), rest
        if not ctx.resilient_parsing:
            ctx.fail(f"No such command: {name}{did_you_mean(name, COMMANDS)}")
        return None, None, rest


def load(name: str) -> Any:  # noqa: ANN401 - a command of typer's own click
    """Import a command."""
    module = import_module(f"bentwing.cli.{name}")
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.command(name, cls=Command, context_settings=CONTEXT, epilog=closing(module.EXAMPLES))(
        module.command
    )
    return typer.main.get_command(app)
