# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing report`: the report of a finished run again, and on paper."""

from typing import Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, option

EXAMPLES = (
    "bentwing report run --pdf",
    "bentwing report run --project project.yaml --pdf",
)


def command(
    run: options.Run,
    *,
    project: options.Project = None,
    pdf: Annotated[
        bool,
        option(RESULT, "--pdf", help="Print it as report.pdf, through Chromium, Chrome or Edge."),
    ] = False,
    quiet: options.Quiet = False,
) -> None:
    """Draw the report of a finished run again, and print it."""
    from bentwing.base.progress import create_progress
    from bentwing.recording.sections.project import as_project
    from bentwing.report.redraw import redraw_report

    named = as_project(project)
    for path in redraw_report(run, project=named, pdf=pdf, progress=create_progress(quiet=quiet)):
        if not quiet:
            typer.echo(path)
