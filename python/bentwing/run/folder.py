# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder a run writes into, and run.json, its record of what was done."""

from __future__ import annotations

import json
import resource
import sys
import time
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_text
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input, versions
from bentwing.base.run_record import RECORD, RUN_FOLDER

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from types import TracebackType

    from typing_extensions import Self

    from bentwing.base.estimate import Estimate


class RunFolder:
    """Context manager around a run.

    run.json is there from the first moment with `"complete": false` and becomes `true` at the
    end. A run that fails or is interrupted keeps what it has written and records the stage and
    the reason. The files of an earlier run are replaced one by one as this run's become ready;
    what is then left of the earlier run is removed when this one completes.

    Parameters
    ----------
    out : folder, made if it does not exist
    settings : what the run was asked to do, goes into the record

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or holds files that are not of a bentwing run.
    """

    def __init__(self, out: Path, settings: dict[str, Any] | None = None) -> None:
        self.path = Path(out)
        self.record: dict[str, Any] = {
            "kind": RUN_FOLDER.kind,
            "complete": False,
            "stage": "start",
            "reason": None,
            "started": datetime.now(timezone.utc).isoformat(timespec="seconds"),
            "versions": versions(),
            "command": sys.argv,
            "settings": settings or {},
            "inputs": [],
            "recordings": [],
            "start_ns": None,
            "files": [],
            "counts": {},
            "timings": {},
            "warnings": [],
            "calibration": None,
            "localization": None,
            "loop_closure": None,
            "georeference": None,
            "map": {},
            "merging": None,
            "segments": [],
            "windows": [],
            "peak_memory_mb": None,
        }
        self._earlier: list[str] = []
        self._started = time.monotonic()

    def __enter__(self) -> Self:
        self._earlier = RUN_FOLDER.claim(self.path)
        self.save()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if error is None:
            self.record["complete"], self.record["stage"] = True, "done"
            self._remove_rest_of_earlier()
        else:
            self.fail(error)
        self.save()

    def fail(self, error: BaseException) -> None:
        """Record why the run ends early."""
        interrupted = isinstance(error, KeyboardInterrupt)
        self.record["reason"] = "interrupted" if interrupted else str(error) or type(error).__name__

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage, and name it in the record should it fail."""
        self.record["stage"] = name
        started = time.monotonic()
        try:
            yield
        finally:
            elapsed = time.monotonic() - started
            timings = self.record["timings"]
            timings[name] = timings.get(name, 0.0) + elapsed

    def add_inputs(self, paths: Iterable[Path]) -> None:
        """Record the files a run reads, with size and hash; folders stand for their files."""
        for path in paths:
            path = Path(path)
            files = sorted(path.rglob("*")) if path.is_dir() else [path]
            self.record["inputs"] += [describe_input(file) for file in files if file.is_file()]

    def add_recordings(self, paths: Iterable[Path], start_ns: int) -> None:
        """Record where the recordings lie, so that their points can be read again, and their clock.

        Parameters
        ----------
        start_ns : what is time zero, ns UTC
        """
        self.record["recordings"] = [str(Path(path).resolve()) for path in paths]
        self.record["start_ns"] = start_ns

    def add_estimate(self, estimate: Estimate) -> None:
        """Record what the estimator says about itself."""
        self.record["counts"].update(estimate.counts)
        for stage, seconds in estimate.timings.items():
            self.record["timings"][f"estimate/{stage}"] = seconds
        self.record["warnings"] += [
            w for w in estimate.warnings if w not in self.record["warnings"]
        ]
        self.record["calibration"] = plain(estimate.calibration)
        self.record["segments"] = plain(estimate.segments)
        self.record["windows"] = plain(estimate.windows)

    def file(self, name: str) -> Path:
        """Path of a result that is about to be written atomically; it becomes part of the record."""
        if name not in self.record["files"]:
            self.record["files"].append(name)
        return self.path / name

    def write_trajectory(self, name: str, estimate: Estimate, clock_origin_ns: int) -> None:
        """Write trajectory.txt or odometry.txt, without the guesses between segments."""
        poses = estimate.trajectory.within(estimate.segments)
        poses.write_tum(self.file(name), clock_origin_ns)

    def save(self) -> None:
        """Write run.json as it stands."""
        self.record["peak_memory_mb"] = round(_peak_memory() / 1e6, 1)
        self.record["timings"]["total"] = time.monotonic() - self._started
        written = [name for name in self.record["files"] if (self.path / name).exists()]
        record = plain({**self.record, "files": written})
        if not self.record["complete"]:
            record["files_of_earlier_run"] = [name for name in self._earlier if name not in written]
        write_text(self.path / RECORD, json.dumps(record, indent=1, allow_nan=False) + "\n")

    def _remove_rest_of_earlier(self) -> None:
        for name in self._earlier:
            if name not in self.record["files"]:
                (self.path / name).unlink(missing_ok=True)


def _peak_memory() -> int:
    """Most bytes this process ever held in memory."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else peak * 1024
