# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder a run writes into."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.atomic import write_text
from bentwing.base.provenance import describe_input
from bentwing.base.run_record import RECORD, RUN_FOLDER
from bentwing.run.record import RunRecord

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from types import TracebackType
    from typing import Any

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
    settings : what decides the run, in plain JSON types

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or holds files that are not of a bentwing run.
    """

    def __init__(self, out: Path, settings: Mapping[str, Any] | None = None) -> None:
        self.path = Path(out)
        self.record = RunRecord(dict(settings or {}))
        self._earlier: list[str] = []

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
            self.record.complete, self.record.stage = True, "done"
            self._remove_rest_of_earlier()
        else:
            self.fail(error)
        self.save()

    def fail(self, error: BaseException) -> None:
        """Record why the run ends early."""
        interrupted = isinstance(error, KeyboardInterrupt)
        self.record.reason = "interrupted" if interrupted else str(error) or type(error).__name__

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage, and name it in the record should it fail."""
        self.record.stage = name
        started = time.monotonic()
        try:
            yield
        finally:
            self.record.add_seconds(name, time.monotonic() - started)

    def add_inputs(self, paths: Iterable[Path]) -> None:
        """Record the files a run reads, with size and hash; folders stand for their files."""
        for path in paths:
            path = Path(path)
            files = sorted(path.rglob("*")) if path.is_dir() else [path]
            self.record.inputs += [describe_input(file) for file in files if file.is_file()]

    def add_recordings(self, paths: Iterable[Path], start_ns: int) -> None:
        """Record where the recordings lie, and their clock.

        Parameters
        ----------
        start_ns : what is time zero, ns UTC
        """
        self.record.recordings = [Path(path).resolve() for path in paths]
        self.record.start_ns = start_ns

    def file(self, name: str) -> Path:
        """Path of a result that is about to be written atomically; it becomes part of the record."""
        if name not in self.record.files:
            self.record.files.append(name)
        return self.path / name

    def write_trajectory(self, name: str, estimate: Estimate, clock_origin_ns: int) -> None:
        """Write a trajectory, without the guesses between segments."""
        poses = estimate.trajectory.within(estimate.segments)
        poses.write_tum(self.file(name), clock_origin_ns)

    def write_covariances(self, name: str, estimate: Estimate, clock_origin_ns: int) -> None:
        """Write the covariances of the poses; without any, no file of that name is a result."""
        if estimate.covariances is not None:
            estimate.covariances.write(self.file(name), clock_origin_ns)
        elif name in self.record.files:
            self.record.files.remove(name)
            (self.path / name).unlink(missing_ok=True)

    def described(self) -> dict[str, Any]:
        """Return run.json as it stands, naming the files that are there."""
        record = self.record.to_json()
        record["files"] = [name for name in record["files"] if (self.path / name).exists()]
        if not self.record.complete:
            left = [name for name in self._earlier if name not in record["files"]]
            record["files_of_earlier_run"] = left
        return record

    def save(self) -> None:
        """Write run.json as it stands."""
        text = json.dumps(self.described(), indent=1, allow_nan=False)
        write_text(self.path / RECORD, text + "\n")

    def _remove_rest_of_earlier(self) -> None:
        for name in self._earlier:
            if name not in self.record.files:
                (self.path / name).unlink(missing_ok=True)
