# SPDX-License-Identifier: MIT OR Apache-2.0
"""run.json: how a run folder is told from others, and its record as plain JSON types."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from bentwing.base.errors import UsageError
from bentwing.base.result_folder import RecordedFolder

RECORD = "run.json"
RUN_FOLDER = RecordedFolder(RECORD, "bentwing run", "run")


def read_record(run: Path) -> dict[str, Any]:
    """Record of the run in a folder.

    Raises
    ------
    UsageError
        If the folder holds no bentwing run.
    """
    record = RUN_FOLDER.read(Path(run))
    if record is None:
        msg = f"{run}: holds no bentwing run ({RECORD} is missing or of another program)"
        raise UsageError(msg)
    return record
