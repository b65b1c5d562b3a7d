# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing reproduce`: a paper's figures and tables, made again."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, get_args

import typer

from bentwing.cli import options
from bentwing.cli.options import ESTIMATION, INPUT, enumeration, option
from bentwing.reproduce.names import PaperName, PartName

if TYPE_CHECKING:
    from enum import Enum as Part
else:
    Part = enumeration("Part", get_args(PartName))

EXAMPLES = (
    "bentwing reproduce kaul2015 -o kaul2015",
    "bentwing reproduce kaul2015 --part flight --quick",
    "bentwing reproduce tazir2020 --quick --seed 2 -o tazir2020",
)


def command(
    paper: Annotated[
        PaperName,
        typer.Argument(
            metavar="PAPER",
            help=f"Paper to reproduce: {', '.join(get_args(PaperName))}.",
            rich_help_panel=INPUT,
        ),
    ],
    *,
    part: Annotated[
        list[Part],
        option(
            INPUT,
            "--part",
            metavar="NAME",
            help=f"Make one part only, repeatable: {', '.join(get_args(PartName))}.",
            show_default="all of the paper's",
        ),
    ] = [],  # noqa: B006 - typer reads it and hands out a copy
    seed: Annotated[
        int, option(ESTIMATION, metavar="N", help="Seed of all that is random.", min=0)
    ] = 1,
    quick: Annotated[
        bool, option(ESTIMATION, "--quick", help="Fly shorter: minutes instead of hours.")
    ] = False,
    out: Annotated[Path | None, options.out(show_default="PAPER")] = None,
    quiet: options.Quiet = False,
) -> None:
    """Make a paper's tables and figures again: report.html, figures as PNG and SVG, numbers as JSON."""
    # slow to import, so only when it is needed
    from rich.console import Console

    from bentwing.base.progress import create_progress
    from bentwing.cli.reproduce_page import page
    from bentwing.reproduce import reproduce

    progress = create_progress(quiet=quiet)
    written = reproduce(
        paper,
        out or Path(paper),
        [one.value for one in part],
        quick=quick,
        seed=seed,
        progress=progress,
    )
    if quiet:
        return
    console = Console()
    for part_of_page in page(written):
        console.print(part_of_page, highlight=False, markup=False, soft_wrap=True)
    typer.echo(f"{written.page}: {len(written.figures)} figures, also as files beside it")
