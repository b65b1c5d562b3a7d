# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder a run writes into."""

from __future__ import annotations

import json
import time
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.atomic import write_text
from bentwing.base.errors import InputError
from bentwing.base.memory import give_back
from bentwing.base.provenance import describe_input, files_of
from bentwing.base.regular_file import resolved
from bentwing.base.result_folder import reason_of
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
    the reason. From then on nothing of an earlier run is there, except while a run that resumes it
    has not yet chosen what it goes on with. The lock of the folder keeps other processes out.

    Parameters
    ----------
    out : folder, made if it does not exist
    settings : what decides the run, in plain JSON types
    resume : keep the files of an earlier run until `remove_earlier` is called
    inputs : files and folders that are still to be read

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, holds files that are not of a bentwing run, or another
        process writes there.
    """

    def __init__(
        self,
        out: Path,
        settings: Mapping[str, Any] | None = None,
        *,
        resume: bool = False,
        inputs: Iterable[Path] = (),
    ) -> None:
        self.path = Path(out)
        self.record = RunRecord(dict(settings or {}))
        self._resume, self._read = resume, inputs
        self._earlier: list[str] = []
        self._inputs: dict[Path, dict[str, Any]] = {}

    def __enter__(self) -> Self:
        self._lock, self._earlier = RUN_FOLDER.claim(self.path, self._read)
        self.save()
        if not self._resume:
            self.remove_earlier()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if error is None:
                self._complete()
            else:
                self.fail(error)
                # On a disk that is full, run.json goes on saying that the run is not complete.
                with suppress(OSError) if isinstance(error, OSError) else nullcontext():
                    self.save()
        finally:
            self._lock.release()

    def _complete(self) -> None:
        record = self.record
        try:
            self.confirm_inputs()
            written = [name for name in record.files if (self.path / name).exists()]
            record.hashes = {name: _hash_of(self.path / name) for name in written}
            record.complete, record.stage = True, "done"
        except InputError as error:
            self.fail(error)
            raise
        finally:
            self.save()

    def fail(self, error: BaseException) -> None:
        """Record why the run ends early."""
        self.record.reason = reason_of(error)

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time a stage, and name it in the record should it fail."""
        self.record.stage = name
        started = time.monotonic()
        try:
            yield
        finally:
            give_back()  # else each stage takes the memory of all those before it, too
            self.record.add_seconds(name, time.monotonic() - started)

    def add_inputs(self, paths: Iterable[Path]) -> None:
        """Record the files a run reads, with size and hash; folders stand for their files."""
        for path in paths:
            for file in files_of(Path(path)):
                self._inputs[file] = found = describe_input(file)
                self.record.inputs.append(found)

    def confirm_inputs(self) -> None:
        """Refuse a result whose inputs are not what they were when the run began.

        Raises
        ------
        InputError
        """
        for file, before in self._inputs.items():
            try:
                is_same = describe_input(file) == before
            except OSError as error:
                msg = f"{file}: cannot be read any more ({error.strerror}), the run has used it"
                raise InputError(msg) from error
            if not is_same:
                msg = (
                    f"{file}: has changed while the run used it; run it again with the file at rest"
                )
                raise InputError(msg)

    def add_recordings(self, paths: Iterable[Path], start_ns: int) -> None:
        """Record where the recordings lie, and their clock.

        Parameters
        ----------
        start_ns : what is time zero, ns UTC
        """
        self.record.recordings = [resolved(Path(path)) for path in paths]
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

    def remove_earlier(self) -> None:
        """Remove what an earlier run has left, but for the files that this run has made its own."""
        RUN_FOLDER.clear(self.path, (n for n in self._earlier if n not in self.record.files))
        self._earlier = []
        self.save()


def _hash_of(path: Path) -> dict[str, Any]:
    found = describe_input(path)
    return {key: found[key] for key in ("bytes", "sha256", "hashed")}
