# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing evaluate`: the evidence about a trajectory and a map."""

import math
from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import INPUT, RESULT, option
from bentwing.map.formats import MAP_FORMATS

_WIDTH = (
    200  # characters; a table of all measures is wider than most terminals, and no number is cut
)

EXAMPLES = (
    "bentwing evaluate run",
    "bentwing evaluate run --reference-trajectory truth.txt --reference-map scan.laz",
    "bentwing evaluate trajectory.txt --reference-trajectory truth.txt -o evaluation",
    "bentwing evaluate run1 run2 run3 --table --reference-trajectory truth.txt -o comparison",
)


def command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN",
            help="Run folder, or a TUM trajectory or a cloud of any program; several with --table.",
            rich_help_panel=INPUT,
        ),
    ],
    *,
    reference_trajectory: Annotated[
        Path | None,
        option(INPUT, metavar="FILE", help="Lines `t x y z` or `t x y z qx qy qz qw` (TUM, CSV)."),
    ] = None,
    reference_map: Annotated[
        Path | None,
        option(INPUT, metavar="FILE", help=f"Cloud ({', '.join(MAP_FORMATS)}) or PLY mesh."),
    ] = None,
    clock_offset: Annotated[
        float | None,
        option(
            INPUT,
            metavar="SECONDS",
            help="By how much the clock of the reference is ahead.",
            show_default="estimated",
        ),
    ] = None,
    lever_arm: Annotated[
        str | None,
        option(
            INPUT,
            metavar="X,Y,Z",
            help="Tracked point in the IMU frame, m.",
            show_default="estimated for positions, 0,0,0 for poses",
        ),
    ] = None,
    changed_beyond: Annotated[
        float,
        option(
            INPUT,
            metavar="METRES",
            help="Distance from the reference map beyond which things have changed.",
        ),
    ] = 0.3,
    table: Annotated[
        bool,
        option(
            RESULT,
            "--table",
            help="Compare several runs: print a row each, and write table.csv, .json and .html.",
        ),
    ] = False,
    out: Annotated[Path | None, options.out(show_default="RUN/evaluation")] = None,
    quiet: options.Quiet = False,
) -> None:
    """Measure the errors of a trajectory and a map: evaluation.json and .html, figures and a table."""
    # slow to import, so only when it is needed
    from rich.console import Console

    from bentwing.base.errors import UsageError
    from bentwing.base.progress import create_progress
    from bentwing.cli.evaluate_page import page, table_of
    from bentwing.evaluate.evaluation import Question
    from bentwing.report.evaluated import compare_into, evaluate_into

    if len(runs) > 1 and not table:
        msg = f"{len(runs)} runs are given: compare them with --table, or give one"
        raise UsageError(msg)
    if out is None and (table or runs[0].is_file()):
        what = "--table" if table else f"{runs[0]} is a file"
        msg = f"{what}: give a folder for the results with -o OUT"
        raise UsageError(msg)
    if not 0 < changed_beyond < math.inf:
        msg = f"--changed-beyond {changed_beyond} cannot be used; give a length in metres above 0"
        raise UsageError(msg)
    arm = None if lever_arm is None else _arm(lever_arm)
    question = Question(reference_trajectory, reference_map, clock_offset, arm, changed_beyond)
    progress, console = create_progress(quiet=quiet), Console()
    if table and out is not None:
        compared = compare_into(out, runs, question, progress)
        for failure in compared.failures:
            typer.echo(f"bentwing: error: {failure}", err=True)
        if not quiet:
            wide = Console(width=max(console.width, _WIDTH))
            wide.print(table_of(compared.head, compared.rows))
            typer.echo(f"{out}: table.csv, table.json, table.html, and a folder for each run")
        return
    results = runs[0] / "evaluation" if out is None else out
    result = evaluate_into(results, runs[0], question, progress)
    if not quiet:
        for part in page(result):
            console.print(part)
        typer.echo(f"{results}: evaluation.json, evaluation.html and figures")


def _arm(given: str) -> tuple[float, float, float]:
    from bentwing.base.errors import UsageError

    try:
        x, y, z = (float(value) for value in given.split(","))
    except ValueError:
        x = y = z = math.nan
    if not all(map(math.isfinite, (x, y, z))):
        msg = (
            f"--lever-arm {given!r} is no point; give three numbers in metres, such as 0.1,0,-0.05"
        )
        raise UsageError(msg)
    return x, y, z
