# SPDX-License-Identifier: MIT OR Apache-2.0
"""A store as a folder of files without content, so that recordings are found there as anywhere.

Only what describes recordings gets its content: a manifest, and the payloads and projects of recordings.
"""

from __future__ import annotations

from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from bentwing.base.errors import BentwingError, InputError
from bentwing.fleet.manifest import MANIFEST_SUFFIXES
from bentwing.fleet.scratch import scratch_folder
from bentwing.fleet.store import Store, is_url
from bentwing.fleet.stored import Stored

if TYPE_CHECKING:
    from collections.abc import Iterator

    from typing_extensions import Self

    from bentwing.fleet.entry import Entry
    from bentwing.fleet.store import StoredFile

_MOST_READ = 2**24  # bytes
_LONGEST = 255  # bytes of a name that a file can have
# A store that does not answer when the command begins is most probably not there.
_PATIENCE = 10.0  # s


class Skeleton:
    """Context manager: the names in stores, as files."""

    def __init__(self) -> None:
        self._stack = ExitStack()
        self._urls: dict[Path, str] = {}
        self._files: dict[Path, StoredFile] = {}
        self._read: set[Path] = set()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def path(self, given: Path | str) -> Path:
        """Return a folder, or a file, that looks like what is at a URL; a path as it is.

        Raises
        ------
        InputError
            If nothing is there, or it cannot be listed.
        """
        if not is_url(given):
            return Path(given)
        url = str(given).rstrip("/")
        above, _, name = url.rpartition("/")
        found = Store(url, _PATIENCE).files()
        if not found:
            msg = (
                f"{url}: nothing is there; give a folder of recordings, one of them, or a manifest"
            )
            raise InputError(msg)
        top = self._stack.enter_context(scratch_folder())
        self._urls[top] = above
        is_manifest = "" in found and name.endswith(MANIFEST_SUFFIXES)
        if is_manifest:  # what it names is relative to where it is
            self._add(top, Store(above, _PATIENCE).files())
            self._fill(top / name)
        else:
            self._add(top / name, found)
        return top / name

    def entry(self, entry: Entry) -> Entry:
        """Return a recording that was found in the skeleton as one of the store.

        Raises
        ------
        InputError
            If what describes it cannot be read, or it has control points, which are read where they are.
        """
        if entry.marks is not None and (url := self._url(entry.marks)):
            msg = (
                f"{url}: control points are not read from a store; give a file that all workers see "
                "with --control-points"
            )
            raise InputError(msg)
        for described in (entry.payload, entry.project):
            if described is not None:
                self._fill(described)
        return replace(entry, parts=tuple(self._stored(part) for part in entry.parts))

    def said(self, text: str) -> str:
        """Return a sentence that names what is in the store by its URL."""
        for top, url in self._urls.items():
            text = text.replace(str(top), url)
        return text

    @contextmanager
    def named(self) -> Iterator[None]:
        """Let errors name what is in the store by its URL."""
        try:
            yield
        except BentwingError as error:
            raise type(error)(self.said(str(error))) from error

    def _add(self, place: Path, found: dict[str, StoredFile]) -> None:
        for name, stored in found.items():
            file = place / name if name else place
            if name and not _is_plain(name):
                continue
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()
            self._files[file] = stored

    def _fill(self, file: Path) -> None:
        """Give a file of the skeleton its content."""
        stored = self._files.get(file)
        if stored is not None and file not in self._read:
            file.write_bytes(Store(stored.url).read("", _MOST_READ))
            self._read.add(file)

    def _stored(self, part: Path | Stored) -> Path | Stored:
        url = None if isinstance(part, Stored) else self._url(part)
        if isinstance(part, Stored) or url is None:
            return part
        if part in self._files:
            return Stored(url, (("", self._files[part]),))
        inside = sorted(file for file in part.rglob("*") if file in self._files)
        return Stored(
            url, tuple((file.relative_to(part).as_posix(), self._files[file]) for file in inside)
        )

    def _url(self, path: Path) -> str | None:
        for top, url in self._urls.items():
            if path.is_relative_to(top):
                return f"{url}/{path.relative_to(top).as_posix()}"
        return None


def _is_plain(name: str) -> bool:
    """Whether the name of an object can be that of a file: a store takes any text."""
    words = name.split("/")
    return "\0" not in name and all(
        word not in {"", ".", ".."} and len(word.encode()) <= _LONGEST for word in words
    )
