# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder of an evaluation: evaluation.json, and figures that another room draws."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.atomic import write_text
from bentwing.evaluate.statistics import summary
from bentwing.run_record import RecordedFolder, describe_input, plain, versions

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bentwing.evaluate.evaluation import Evaluation, Question

RECORD = "evaluation.json"
_KIND = "bentwing evaluation"
_FOLDER = RecordedFolder(RECORD, _KIND, "evaluation", "an")


class EvaluationFolder:
    """Folder that holds one evaluation; the files of an earlier one are replaced.

    Parameters
    ----------
    out : folder, made if it does not exist

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or holds files that are not of an evaluation.
    """

    def __init__(self, out: Path) -> None:
        self.path = Path(out)
        self._earlier = _FOLDER.claim(self.path)
        self._files: list[str] = []

    def file(self, name: str) -> Path:
        """Path of a figure that is about to be written atomically."""
        self._files.append(name)
        # whatever happens before the end, the folder can be told to be ours
        self._write({"kind": _KIND, "complete": False, "files": {*self._files, *self._earlier}})
        return self.path / name

    def finish(self, evaluation: Evaluation, question: Question, inputs: Iterable[Path]) -> None:
        """Write evaluation.json, last of all, and remove what is left of an earlier evaluation."""
        record = {
            "kind": _KIND,
            "complete": True,
            "versions": versions(),
            "inputs": [describe_input(path) for path in inputs],
            "question": question,
            **summary(evaluation),
            "files": sorted(self._files),
        }
        self._write(record)
        for name in self._earlier:
            if name not in self._files:
                (self.path / name).unlink(missing_ok=True)

    def _write(self, record: dict[str, Any]) -> None:
        text = json.dumps(plain(record), indent=1, allow_nan=False)
        write_text(self.path / RECORD, text + "\n")
