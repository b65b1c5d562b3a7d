# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing reproduce`: a paper's figures and tables, made again."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import Annotated

import typer

Option = typer.Option


def reproduce_command(
    paper: Annotated[str, typer.Argument(help="kaul2015.")],
    out: Annotated[Path, Option("-o", "--out", help="Folder to write into.")],
    part: Annotated[
        list[str] | None,
        Option(help="Repeatable: flight.", show_default="all of the paper's"),
    ] = None,
    *,
    quick: Annotated[bool, Option("--quick", help="Less of everything, in a minute.")] = False,
) -> None:
    """Make a paper's figures again: a page per part, its figures as SVG, the numbers as JSON."""
    from bentwing.reproduce import reproduce  # slow to import, so only when it is needed

    written = reproduce(paper, out, part or (), quick=quick)
    for page in written.pages:
        typer.echo(f"{page}: {len(written.figures)} figures beside it")
