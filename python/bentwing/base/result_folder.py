# SPDX-License-Identifier: MIT OR Apache-2.0
"""Folders that hold one result each, told by the record in them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import TEMPORARY_SUFFIX, write_text
from bentwing.base.errors import UsageError
from bentwing.base.plain import plain
from bentwing.base.provenance import describe_input, versions

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


@dataclass(frozen=True, slots=True)
class RecordedFolder:
    """Folders of one kind, which are told by the record they hold.

    Attributes
    ----------
    record : name of the record's file
    kind : what the record says it is
    noun : what the folder holds, for messages
    article : of the noun
    """

    record: str
    kind: str
    noun: str
    article: str = "a"

    def read(self, path: Path) -> dict[str, Any] | None:
        """Return the record in a folder, None without one of this kind."""
        try:
            record = json.loads((path / self.record).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        return record if isinstance(record, dict) and record.get("kind") == self.kind else None

    def claim(self, path: Path) -> list[str]:
        """Make the folder ours; return the names of the files of what was there.

        Raises
        ------
        UsageError
            If the path cannot be a folder, or holds files of something else.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            entries = list(path.iterdir())
        except OSError as error:
            what = f"{self.article} {self.noun}"
            msg = f"{path}: cannot be made the folder of {what} ({error.strerror}); choose another"
            raise UsageError(msg) from error
        leftovers = [entry for entry in entries if entry.name.endswith(TEMPORARY_SUFFIX)]
        record = self.read(path)
        if record is None and len(entries) > len(leftovers):
            msg = (
                f"{path}: is not empty and holds no earlier {self.noun}; "
                "choose a new or empty folder"
            )
            raise UsageError(msg)
        for entry in leftovers:
            entry.unlink()
        record = record or {}
        names = [*record.get("files", []), *record.get("files_of_earlier_run", [])]
        return [name for name in names if isinstance(name, str) and Path(name).name == name]


class ResultFolder:
    """Folder that holds one result and its record; the files of an earlier one are replaced.

    Parameters
    ----------
    out : folder, made if it does not exist
    of : its kind

    Raises
    ------
    UsageError
        If `out` is a file, cannot be made, or holds files that are not of this kind.
    """

    def __init__(self, out: Path, of: RecordedFolder) -> None:
        self.path = Path(out)
        self._of = of
        self._earlier = of.claim(self.path)
        self._files: list[str] = []

    def file(self, name: str) -> Path:
        """Path of a file that is about to be written atomically."""
        self._files.append(name)
        # whatever happens before the end, the folder can be told to be ours
        files = {*self._files, *self._earlier}
        self._write({"kind": self._of.kind, "complete": False, "files": files})
        return self.path / name

    def complete(self, inputs: Iterable[Path], content: Mapping[str, Any]) -> None:
        """Write the record, last of all, and remove what is left of an earlier result."""
        record = {
            "kind": self._of.kind,
            "complete": True,
            "versions": versions(),
            "inputs": [describe_input(path) for path in inputs],
            **content,
            "files": sorted(self._files),
        }
        self._write(record)
        for name in self._earlier:
            if name not in self._files:
                (self.path / name).unlink(missing_ok=True)

    def _write(self, record: dict[str, Any]) -> None:
        text = json.dumps(plain(record), indent=1, allow_nan=False)
        write_text(self.path / self._of.record, text + "\n")
