# SPDX-License-Identifier: MIT OR Apache-2.0
"""Folders that hold one result each, told by the record in them."""

from __future__ import annotations

import json
from contextlib import nullcontext, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import TEMPORARY_SUFFIX, write_text
from bentwing.base.errors import UsageError
from bentwing.base.folder_lock import LOCK, FolderLock
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input, versions
from bentwing.base.regular_file import resolved

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from types import TracebackType

    from typing_extensions import Self

_MOST_OF_RECORD = 2**28  # bytes


@dataclass(frozen=True, slots=True)
class RecordedFolder:
    """Folders of one kind, which are told by the record they hold.

    Attributes
    ----------
    record : name of the record's file
    kind : what the record says it is
    noun : what the folder holds, for messages
    article : of the noun
    about : folders inside of these names and kinds say something about the result
    """

    record: str
    kind: str
    noun: str
    article: str = "a"
    about: tuple[tuple[str, RecordedFolder], ...] = ()

    def read(self, path: Path) -> dict[str, Any] | None:
        """Return the record in a folder, None without one of this kind."""
        file = path / self.record
        try:
            if not file.is_file() or file.stat().st_size > _MOST_OF_RECORD:
                return None
            record = json.loads(file.read_text(encoding="utf-8"))
        except (OSError, ValueError, RecursionError):
            return None
        return record if isinstance(record, dict) and record.get("kind") == self.kind else None

    def write(self, path: Path, record: Mapping[str, Any]) -> None:
        """Write the record in a folder, atomically."""
        text = json.dumps(plain(record), indent=1, allow_nan=False)
        write_text(path / self.record, text + "\n")

    def claim(self, path: Path, inputs: Iterable[Path] = ()) -> tuple[FolderLock, list[str]]:
        """Make the folder ours: return its lock and the names of the files of what was there.

        Parameters
        ----------
        inputs : files and folders that are still to be read

        Raises
        ------
        UsageError
            If the path cannot be a folder, holds files of something else or an input that would be
            removed, or another process writes there.
        """
        lock = FolderLock(path)
        try:
            path.mkdir(parents=True, exist_ok=True)
            self._require_ours(path)
            lock.acquire()
            entries = self._require_ours(path)
            for entry in entries:
                if entry.name.endswith(TEMPORARY_SUFFIX) and entry.is_file():
                    entry.unlink()
        except OSError as error:
            what = f"{self.article} {self.noun}"
            msg = f"{path}: cannot be made the folder of {what} ({error.strerror}); choose another"
            raise UsageError(msg) from error
        names = self._files(path)
        try:
            _require_elsewhere(path, names, inputs)
        except UsageError:
            lock.release()
            raise
        return lock, names

    def clear(self, path: Path, names: Iterable[str]) -> None:
        """Remove files of an earlier result, and what says something about it."""
        for name in names:
            (path / name).unlink(missing_ok=True)
        for name, kind in self.about:
            inside = path / name
            if kind.read(inside) is not None:
                kind.remove(inside)

    def remove(self, path: Path) -> None:
        """Remove a whole result with its folder, unless that holds something else."""
        self.clear(path, [*self._files(path), self.record])
        with suppress(OSError):  # what is not ours stays
            path.rmdir()

    def _files(self, path: Path) -> list[str]:
        record = self.read(path) or {}
        listed = (record.get("files"), record.get("files_of_earlier_run"))
        names = [name for part in listed if isinstance(part, list) for name in part]
        return [name for name in names if is_plain_name(name)]

    def _require_ours(self, path: Path) -> list[Path]:
        entries = [entry for entry in path.iterdir() if entry.name != LOCK]
        left = [entry for entry in entries if not entry.name.endswith(TEMPORARY_SUFFIX)]
        if left and self.read(path) is None:
            msg = (
                f"{path}: is not empty and holds no earlier {self.noun}; "
                "choose a new or empty folder"
            )
            raise UsageError(msg)
        return entries


def _require_elsewhere(path: Path, names: Iterable[str], inputs: Iterable[Path]) -> None:
    removed = {resolved(path), *(resolved(path / name) for name in names)}
    for given in inputs:
        if resolved(given) in removed:
            msg = (
                f"{given}: is read, and would be removed with what {path} holds now; choose another "
                "folder for the result"
            )
            raise UsageError(msg)


def is_plain_name(name: object) -> bool:
    """Whether this names a file of a folder itself, whatever a record may say."""
    return isinstance(name, str) and "\0" not in name and Path(name).name == name != ".."


class ResultFolder:
    """Context manager around a folder that holds one result and its record.

    From its beginning the record says that the result is not complete, and nothing of an earlier
    result is there any more.

    Parameters
    ----------
    out : folder, made if it does not exist
    of : its kind
    inputs : files that are still to be read

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, holds files that are not of this kind, or another process
        writes there.
    """

    def __init__(self, out: Path, of: RecordedFolder, inputs: Iterable[Path] = ()) -> None:
        self.path = Path(out)
        self._of, self._inputs = of, inputs
        self._files: list[str] = []
        self._is_complete = False

    def __enter__(self) -> Self:
        self._lock, earlier = self._of.claim(self.path, self._inputs)
        self._write({**self._begun(), "files": earlier})
        self._of.clear(self.path, earlier)
        self._write(self._begun())
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        try:
            if error is not None and not self._is_complete:
                # On a disk that is full, the record goes on saying that the result is not complete.
                with suppress(OSError) if isinstance(error, OSError) else nullcontext():
                    self._write({**self._begun(), "reason": reason_of(error)})
        finally:
            self._lock.release()

    def file(self, name: str) -> Path:
        """Path of a file that is about to be written atomically."""
        self._files.append(name)
        # whatever happens before the end, the folder can be told to be ours
        self._write(self._begun())
        return self.path / name

    def complete(self, inputs: Iterable[Path], content: Mapping[str, Any]) -> None:
        """Write the record, last of all."""
        record = {
            "kind": self._of.kind,
            "complete": True,
            "versions": versions(),
            "inputs": [describe_input(path) for path in inputs],
            **content,
            "files": sorted(self._files),
        }
        self._write(record)
        self._is_complete = True

    def _begun(self) -> dict[str, Any]:
        return {"kind": self._of.kind, "complete": False, "files": sorted(self._files)}

    def _write(self, record: dict[str, Any]) -> None:
        self._of.write(self.path, record)


def reason_of(error: BaseException) -> str:
    """Return why something ended early, for its record."""
    if isinstance(error, KeyboardInterrupt):
        return str(error) or "interrupted"
    return str(error) or type(error).__name__
