# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a command that has made a map says at its end."""

from __future__ import annotations

from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.run.merging import Merged


def say_run(out: Path) -> None:
    """Say where the report of a run is."""
    typer.echo(f"{out}: open {out / 'report.html'}")


def say_maps(merged: Merged) -> None:
    """Say which maps there are, and which runs are in them."""
    if len(merged.maps) > 1:
        typer.echo(f"not all runs have places in common: {len(merged.maps)} separate maps")
    for one in merged.maps:
        typer.echo(f"{one.out}: {', '.join(one.names)}; open {one.out / 'report.html'}")
