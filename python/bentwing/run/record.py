# SPDX-License-Identifier: MIT OR Apache-2.0
"""run.json: what was done, with which inputs and settings, and what was found."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass, field
from datetime import datetime, timezone
from typing import TYPE_CHECKING, Any

from bentwing.base.memory import peak_memory
from bentwing.base.plain import plain
from bentwing.base.provenance import versions
from bentwing.base.run_record import RUN_FOLDER
from bentwing.run.found import Found

if TYPE_CHECKING:
    from pathlib import Path


def _now() -> str:
    return datetime.now(timezone.utc).isoformat(timespec="seconds")


@dataclass(slots=True)
class RunRecord:
    """The record of a run; its folder keeps it and writes it.

    Attributes
    ----------
    settings : what decides the run, in plain JSON types
    request : SHA-256 of what was asked for, by which a run that need not be made again is told
    complete : whether all stages are done
    stage : the one that is under way, or in which the run ended
    reason : why it ended early
    inputs : name, size and hash of each file that was read
    recordings : where the recordings lie, so that their points can be read again
    start_ns : what is time zero, ns UTC
    files : names of the results in the folder
    hashes : size and SHA-256 of these, once the run is complete
    timings : s of wall time by stage
    cost : time and memory as the report tells them; None until it is drawn
    found : what the stages have found
    """

    settings: dict[str, Any] = field(default_factory=dict)
    request: str | None = None
    complete: bool = False
    stage: str = "start"
    reason: str | None = None
    inputs: list[dict[str, Any]] = field(default_factory=list)
    recordings: list[Path] = field(default_factory=list)
    start_ns: int | None = None
    files: list[str] = field(default_factory=list)
    hashes: dict[str, dict[str, Any]] = field(default_factory=dict)
    timings: dict[str, float] = field(default_factory=dict)
    cost: dict[str, Any] | None = None
    found: Found = field(default_factory=Found)
    started: str = field(default_factory=_now)
    _since: float = field(default_factory=time.monotonic)

    def add_seconds(self, stage: str, seconds: float) -> None:
        """Add to the time that a stage has taken."""
        self.timings[stage] = self.timings.get(stage, 0.0) + seconds

    def settle(self, report_seconds: float) -> dict[str, Any]:
        """Measure time and memory for the last time, so that the report and run.json say the same.

        Parameters
        ----------
        report_seconds : that drawing the report has taken
        """
        self.timings["report"] = report_seconds
        self.cost = self._cost()
        return self.cost

    def _cost(self) -> dict[str, Any]:
        total = time.monotonic() - self._since
        return {
            "timings": {**self.timings, **self.found.timings, "total": total},
            "peak_memory_mb": round(peak_memory() / 1e6, 1),
        }

    def to_json(self) -> dict[str, Any]:
        """Return the record in plain JSON types."""
        found = self.found.to_json()
        described: dict[str, Any] = plain(
            {
                "kind": RUN_FOLDER.kind,
                "complete": self.complete,
                "stage": self.stage,
                "reason": self.reason,
                "started": self.started,
                "versions": versions(),
                "command": sys.argv,
                "settings": self.settings,
                "request": self.request,
                "inputs": self.inputs,
                "recordings": self.recordings,
                "start_ns": self.start_ns,
                "files": self.files,
                "hashes": self.hashes,
                **found,
                **(self.cost or self._cost()),
            }
        )
        return described
