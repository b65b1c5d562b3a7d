# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing evaluate`: the evidence about a trajectory and a map."""

import math
from pathlib import Path
from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import INPUT, option
from bentwing.map.formats import MAP_FORMATS

EXAMPLES = (
    "bentwing evaluate run",
    "bentwing evaluate run --reference-trajectory truth.txt --reference-map scan.laz",
    "bentwing evaluate trajectory.txt --reference-trajectory truth.txt -o evaluation",
)


def command(
    run: Annotated[
        Path,
        typer.Argument(
            metavar="RUN",
            help="Run folder, or a TUM trajectory or a cloud of any program.",
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
    out: Annotated[Path | None, options.out(show_default="RUN/evaluation")] = None,
    quiet: options.Quiet = False,
) -> None:
    """Measure the errors of a trajectory and a map: evaluation.json, figures and a table."""
    # slow to import, so only when it is needed
    from rich.console import Console

    from bentwing.base.errors import UsageError
    from bentwing.base.progress import create_progress
    from bentwing.cli.evaluate_page import page
    from bentwing.evaluate.evaluation import Question, evaluate
    from bentwing.evaluate.folder import EvaluationFolder
    from bentwing.evaluate.subject import find_subject
    from bentwing.report import draw_evaluation

    subject = find_subject(run)
    if out is None and run.is_file():
        msg = f"{run} is a file: give a folder for the results with -o OUT"
        raise UsageError(msg)
    if not 0 < changed_beyond < math.inf:
        msg = f"--changed-beyond {changed_beyond} cannot be used; give a length in metres above 0"
        raise UsageError(msg)
    arm = None if lever_arm is None else _arm(lever_arm)
    question = Question(reference_trajectory, reference_map, clock_offset, arm, changed_beyond)
    references = [path for path in (reference_trajectory, reference_map) if path is not None]
    progress = create_progress(quiet=quiet)
    results = run / "evaluation" if out is None else out
    with EvaluationFolder(results, references) as folder:
        result = evaluate(subject, question, progress)
        with progress.stage("drawing"):
            draw_evaluation(folder, result)
        folder.finish(result, question, [*subject.files(), *references])
    if quiet:
        return
    console = Console()
    for part in page(result):
        console.print(part)
    typer.echo(f"{folder.path}: evaluation.json and figures")


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
