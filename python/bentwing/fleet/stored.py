# SPDX-License-Identifier: MIT OR Apache-2.0
"""Inputs that no file system of the worker has: recordings in a store, and small files of the client."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import InputError
from bentwing.base.plain import plain
from bentwing.fleet.scratch import require_space, scratch_folder
from bentwing.fleet.store import Store, StoredFile

if TYPE_CHECKING:
    from collections.abc import Mapping

    from typing_extensions import Self

_MOST_CARRIED = 2**24  # bytes


@dataclass(frozen=True, slots=True)
class Stored:
    """A recording in a store.

    Attributes
    ----------
    url : of an object, or of a folder of objects
    files : the objects, by their names in the folder; '' where it is one itself
    """

    url: str
    files: tuple[tuple[str, StoredFile], ...]

    @classmethod
    def at(cls, url: str, patience: float = 300.0) -> Stored:
        """Find what lies at a URL; see `Store`."""
        return cls(url.rstrip("/"), tuple(sorted(Store(url, patience).files().items())))

    def __str__(self) -> str:
        return self.url

    @property
    def size(self) -> int:
        """Bytes of all files."""
        return sum(file.size for _, file in self.files)

    def inputs(self) -> list[dict[str, Any]]:
        """Return name, size and tag of each file, as `inputs_of` does of files here."""
        if not self.files:
            msg = f"{self.url}: no such object; check the name"
            raise InputError(msg)
        return [
            {"name": name or file.name, "bytes": file.size, "tag": file.tag}
            for name, file in self.files
        ]

    def fetch(self, folder: Path) -> Path:
        """Copy the recording into a folder and return where it is; raises as `Store.fetch`."""
        require_space(folder, self.size, self.url)
        place = folder / self.url.rsplit("/", 1)[1]
        store = Store(self.url)
        for name, file in self.files:
            store.fetch(name, file, place / name if name else place)
        return place


@dataclass(frozen=True, slots=True)
class Carried:
    """A small file that travels with the work.

    Attributes
    ----------
    name : of the file
    content : bytes
    """

    name: str
    content: bytes = field(repr=False)

    @classmethod
    def of(cls, path: Path) -> Carried:
        """Read a file.

        Raises
        ------
        InputError
            If it is not small.
        """
        if (size := path.stat().st_size) > _MOST_CARRIED:
            msg = f"{path}: has {size} bytes, more than {_MOST_CARRIED} that a file of its kind may have"
            raise InputError(msg)
        return cls(path.name, path.read_bytes())

    def fetch(self, folder: Path) -> Path:
        """Write the file into a folder and return where it is."""
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / self.name
        path.write_bytes(self.content)
        return path


class Fetched:
    """Context manager: inputs in a scratch folder, and what they are called elsewhere.

    Attributes
    ----------
    names : what stands for each path of the scratch folder
    """

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._folder: Path | None = None
        self.names: dict[str, str] = {}

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def path(self, given: Path | Stored | Carried) -> Path:
        """Return where an input is here; one that is not is fetched into a folder of its own."""
        if isinstance(given, Path):
            return given
        if self._folder is None:
            self._folder = self._stack.enter_context(scratch_folder())
        place = given.fetch(self._folder / f"input-{len(self.names)}")
        self.names[str(place)] = str(given) if isinstance(given, Stored) else given.name
        return place

    def named(self, value: Any) -> Any:  # noqa: ANN401 - JSON
        """Return plain JSON values without paths of the scratch folder."""
        return renamed(plain(value), self.names)


def renamed(value: Any, names: Mapping[str, str]) -> Any:  # noqa: ANN401 - JSON
    """Replace paths in all texts of plain JSON values."""
    if isinstance(value, dict):
        return {key: renamed(one, names) for key, one in value.items()}
    if isinstance(value, list):
        return [renamed(one, names) for one in value]
    if isinstance(value, str):
        for path, name in names.items():
            value = value.replace(path, name)
    return value
