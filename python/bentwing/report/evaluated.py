# SPDX-License-Identifier: MIT OR Apache-2.0
"""From runs to folders of evaluations: one run, or several with a table of all."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from bentwing.base.atomic import write_text
from bentwing.base.errors import BentwingError, UsageError
from bentwing.base.progress import as_progress
from bentwing.evaluate.evaluation import evaluate
from bentwing.evaluate.folder import EvaluationFolder
from bentwing.evaluate.subject import find_subject
from bentwing.report.evaluation_table import EvaluationTable
from bentwing.report.of_evaluation import draw_evaluation

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.base.progress import Progress
    from bentwing.evaluate.evaluation import Evaluation, Question


def evaluate_into(
    out: Path, run: Path, question: Question, progress: Progress | None = None
) -> Evaluation:
    """Evaluate a run into a folder: evaluation.json, evaluation.html and figures.

    Raises
    ------
    UsageError, InputError
        As of `evaluate`, or if the folder holds something else.
    """
    subject, shown = find_subject(run), as_progress(progress)
    references = question.files()
    with EvaluationFolder(out, references) as folder:
        result = evaluate(subject, question, shown)
        with shown.stage("drawing"):
            draw_evaluation(folder, result, run.resolve().name)
        folder.finish(result, question, [*subject.files(), *references])
    return result


def compare_into(
    out: Path, runs: Sequence[Path], question: Question, progress: Progress | None = None
) -> EvaluationTable:
    """Evaluate runs into folders of their names in a folder, with table.csv, .json and .html of all.

    A run that cannot be evaluated gets an empty row; `failures` of the table has the reason.

    Raises
    ------
    UsageError, InputError
        If no run can be evaluated, or two have one name, or the folder holds something else.
    """
    names = [run.resolve().name for run in runs]
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        msg = f"{len(runs)} runs: {', '.join(twice)} is the name of several; rename a folder"
        raise UsageError(msg)
    found: list[Evaluation | None] = []
    failures: list[str] = []
    with EvaluationFolder(out, question.files()) as folder:
        for run, name in zip(runs, names, strict=True):
            is_last_hope = len(found) == len(runs) - 1 and not any(found)
            found.append(
                evaluate_into(folder.path / name, run, question, progress)
                if is_last_hope
                else _if_possible(folder.path / name, run, question, progress, failures)
            )
        table = EvaluationTable(names, found, failures)
        written = {
            "table.csv": table.to_csv(),
            "table.json": json.dumps(table.to_json(), indent=1) + "\n",
            "table.html": table.to_html(),
        }
        for name, text in written.items():
            write_text(folder.file(name), text)
        folder.complete(question.files(), {"question": question, "runs": runs})
    return table


def _if_possible(
    out: Path,
    run: Path,
    question: Question,
    progress: Progress | None,
    failures: list[str],
) -> Evaluation | None:
    try:
        return evaluate_into(out, run, question, progress)
    except BentwingError as error:
        failures.append(f"{out.name}: {error}")
        return None
