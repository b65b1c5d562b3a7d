# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder of an evaluation: evaluation.json, and figures that another room draws."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.result_folder import ResultFolder
from bentwing.base.run_record import EVALUATION_FOLDER
from bentwing.evaluate.statistics import summary

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from bentwing.evaluate.evaluation import Evaluation, Question


class EvaluationFolder(ResultFolder):
    """Folder that holds one evaluation; see `ResultFolder`."""

    def __init__(self, out: Path, inputs: Iterable[Path] = ()) -> None:
        super().__init__(out, EVALUATION_FOLDER, inputs)

    def finish(self, evaluation: Evaluation, question: Question, inputs: Iterable[Path]) -> None:
        """Write evaluation.json, last of all."""
        self.complete(inputs, {"question": question, **summary(evaluation)})
