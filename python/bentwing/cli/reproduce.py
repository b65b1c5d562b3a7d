# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing reproduce`: a paper's figures and tables, made again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Option = typer.Option


def reproduce_command(
    paper: Annotated[str, typer.Argument(help="kaul2015, fu2023 or tazir2020.")],
    out: Annotated[
        Path | None, Option("-o", "--out", help="Folder to write into.", show_default="PAPER")
    ] = None,
    part: Annotated[
        list[str] | None,
        Option(help="Repeatable: mapping, flight.", show_default="all of the paper's"),
    ] = None,
    *,
    seed: Annotated[int, Option(help="Of all that is random.", min=0)] = 1,
    quick: Annotated[bool, Option("--quick", help="Less of everything, in minutes.")] = False,
    quiet: Annotated[bool, Option("--quiet", help="Say nothing but errors.")] = False,
) -> None:
    """Make a paper's tables and figures again: report.html, figures as PNG and SVG, numbers as JSON."""
    # slow to import, so only when it is needed
    from rich.console import Console
    from rich.table import Table

    from bentwing.base.progress import create_progress
    from bentwing.reproduce import reproduce

    progress = create_progress(quiet=quiet)
    written = reproduce(
        paper, out or Path(paper), part or (), quick=quick, seed=seed, progress=progress
    )
    if quiet:
        return
    console = Console()
    for made in written.parts:
        for shown in made.tables:
            typer.echo(shown.markdown())
        if made.compared:
            table = Table(title=made.title, title_justify="left", box=None)
            for heading in ("", "paper", "bentwing", "aim", ""):
                table.add_column(heading)
            for row in made.compared:
                table.add_row(row.what, row.paper, row.ours, row.aim, _MET[row.met])
            console.print(table)
    typer.echo(f"{written.page}: {len(written.figures)} figures, also as files beside it")


_MET = {True: "[green]met[/green]", False: "[red]missed[/red]", None: ""}
