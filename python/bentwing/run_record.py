# SPDX-License-Identifier: MIT OR Apache-2.0
"""What run.json says about inputs, versions and values, in plain JSON types."""

from __future__ import annotations

import hashlib
import json
import math
import os
import platform
from dataclasses import dataclass, fields, is_dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.atomic import TEMPORARY_SUFFIX, write_text
from bentwing.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

FULL_HASH_LIMIT = 256 * 2**20  # bytes; larger files are hashed at both ends only
_END = 2**20


def versions() -> dict[str, str]:
    """Versions of everything that can change a result."""
    return {
        "bentwing": bentwing_version(),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "platform": platform.platform(),
        "cpu_count": str(os.cpu_count()),
    }


def bentwing_version() -> str:
    """Version of the installed package; "unknown" when run from a bare source tree."""
    try:
        return version("bentwing")
    except PackageNotFoundError:
        return "unknown"


def describe_input(path: Path) -> dict[str, Any]:
    """Name, size and SHA-256 of an input.

    Files above `FULL_HASH_LIMIT` are hashed over their first and last MiB, which `hashed` says.
    """
    size = path.stat().st_size
    digest = hashlib.sha256()
    with path.open("rb") as file:
        if size <= FULL_HASH_LIMIT:
            while block := file.read(_END):
                digest.update(block)
        else:
            digest.update(file.read(_END))
            file.seek(size - _END)
            digest.update(file.read(_END))
    hashed = "all" if size <= FULL_HASH_LIMIT else "first and last MiB"
    return {"name": path.name, "bytes": size, "sha256": digest.hexdigest(), "hashed": hashed}


def plain(value: Any) -> Any:  # noqa: ANN401 - takes and returns whatever JSON can hold
    """Turn dataclasses, arrays, models and paths into JSON types; what is not finite into None."""
    if hasattr(value, "model_dump"):
        return plain(value.model_dump())
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple, set, frozenset)):
        return [plain(item) for item in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


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
