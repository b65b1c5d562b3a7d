# SPDX-License-Identifier: MIT OR Apache-2.0
"""Object stores, and whatever else fsspec reads by a URL: what lies there, to here and from here.

Objects appear under their names only when they are whole. What several objects make together is there
when the one that is written last is.
"""

from __future__ import annotations

import errno
import re
import time
from dataclasses import dataclass
from functools import partial
from itertools import chain, repeat
from typing import TYPE_CHECKING, Any, TypeVar, cast

from bentwing.base.errors import InputError, UsageError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping
    from pathlib import Path

_Result = TypeVar("_Result")
_URL = re.compile(r"[a-z][a-z0-9+.-]+://", re.IGNORECASE)
_BLOCK = 2**23  # bytes read at a time
# Each library has errors of its own for a network that fails; their names agree.
_OF_NETWORK = re.compile(r"Connection|Connector|Timeout|Incomplete|Disconnected|PayloadError")
_OF_SERVER = frozenset({errno.EIO, errno.EBUSY})  # "slow down", "try again"
_PAUSES = (1.0, 2.0, 5.0, 10.0, 20.0)  # s before trying again; the last one repeats
_TAGS = ("ETag", "etag", "md5Hash", "content_md5", "LastModified", "updated", "mtime", "created")


def is_url(path: object) -> bool:
    """Whether a text names an object of a store rather than a file."""
    return bool(_URL.match(str(path)))


class ChangedError(InputError):
    """An object is not any more the one that was listed."""


@dataclass(frozen=True, slots=True)
class StoredFile:
    """An object.

    Attributes
    ----------
    url : where it is
    size : bytes
    tag : tells its content from others: the store's hash of it, or when it was written
    """

    url: str
    size: int
    tag: str

    @property
    def name(self) -> str:
        """Last part of its name."""
        return self.url.rsplit("/", 1)[1]


class Store:
    """What lies below a URL.

    Parameters
    ----------
    url : of a folder, or of an object
    patience : s for which a connection that fails is tried again

    Raises
    ------
    UsageError
        If no installed package reads such URLs.
    """

    def __init__(self, url: str, patience: float = 300.0) -> None:
        self.url, self._patience = url.rstrip("/"), patience
        self._files, self._root = _file_system(self.url)

    def files(self, under: str = "") -> dict[str, StoredFile]:
        """Return all objects in a folder below, by their names here; an object itself has the name ''."""

        def listed() -> Mapping[str, Any]:
            self._files.invalidate_cache()
            found: Mapping[str, Any] = self._files.find(self._path(under), detail=True)
            return found

        found = self._patiently(self._of(under), listed)
        named = {path[len(self._root) + 1 :]: info for path, info in found.items()}
        return {name: self._stored(name, info) for name, info in named.items()}

    def read(self, name: str, most: int) -> bytes:
        """Return the content of a small object.

        Raises
        ------
        InputError
            If there is none, or it has more bytes than `most`.
        """

        def content() -> bytes:
            found: bytes = self._files.cat_file(self._path(name), start=0, end=most + 1)
            return found

        found = self._patiently(self._of(name), content)
        if len(found) > most:
            msg = f"{self._of(name)}: has more than {most} bytes, which a file of its kind may have"
            raise InputError(msg)
        return found

    def fetch(self, name: str, expected: StoredFile, path: Path) -> None:
        """Copy an object into a file, and go on where a connection was lost.

        Raises
        ------
        ChangedError
            If it is not the one that was listed, or becomes another meanwhile.
        InputError
            If it cannot be read.
        """
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("wb") as out:

            def copied() -> None:
                self._require_same(name, expected)
                with self._files.open(self._path(name), "rb", cache_type="none") as source:
                    source.seek(out.tell())
                    while block := source.read(_BLOCK):
                        out.write(block)
                self._require_same(name, expected)

            self._patiently(expected.url, copied)
        if path.stat().st_size != expected.size:
            msg = f"{expected.url}: {path.stat().st_size} of {expected.size} bytes came; try again"
            raise InputError(msg)

    def put(self, path: Path, name: str) -> None:
        """Copy a file to an object, in place of an earlier one."""
        self._patiently(self._of(name), lambda: self._files.put_file(str(path), self._path(name)))

    def write(self, name: str, content: bytes) -> None:
        """Write a small object."""
        self._patiently(self._of(name), lambda: self._files.pipe_file(self._path(name), content))

    def remove(self, names: Iterable[str]) -> None:
        """Remove objects; one that is gone already is as good."""
        for name in names:
            self._patiently(self._of(name), partial(self._remove, name))

    def _remove(self, name: str) -> None:
        if self._files.exists(self._path(name)):
            self._files.rm_file(self._path(name))

    def _require_same(self, name: str, expected: StoredFile) -> None:
        self._files.invalidate_cache()
        now = self._stored(name, self._files.info(self._path(name)))
        if now != expected:
            msg = (
                f"{expected.url}: has changed since it was listed ({expected.size} bytes then, {now.size} "
                "now); start again when nobody writes there"
            )
            raise ChangedError(msg)

    def _stored(self, name: str, info: Mapping[str, Any]) -> StoredFile:
        # A hash is not of a version: what was written again with the same content is the same.
        said = [str(info[key]).strip('"') for key in _TAGS if info.get(key) is not None]
        return StoredFile(self._of(name), int(info["size"]), said[0] if said else "")

    def _path(self, name: str) -> str:
        return f"{self._root}/{name}" if name else self._root

    def _of(self, name: str) -> str:
        return f"{self.url}/{name}" if name else self.url

    def _patiently(self, url: str, call: Callable[[], _Result]) -> _Result:
        """Call until the network lets it be done.

        Raises
        ------
        InputError
            If the store refuses it, or no connection came about for as long as we are patient.
        """
        end, pauses = time.monotonic() + self._patience, chain(_PAUSES, repeat(_PAUSES[-1]))
        result, error = _tried(call)
        while error is not None:
            if isinstance(error, InputError):
                raise error
            pause = next(pauses)
            if not _may_pass(error) or time.monotonic() + pause > end:
                raise _described(url, error) from error
            time.sleep(pause)
            result, error = _tried(call)
        return cast("_Result", result)


def _tried(call: Callable[[], _Result]) -> tuple[_Result | None, Exception | None]:
    """Return what a call returns, or what it raises."""
    try:
        return call(), None
    except Exception as error:  # each library has its own
        return None, error


def _file_system(url: str) -> tuple[Any, str]:
    try:
        import fsspec
    except ImportError:
        msg = f"{url}: reading an object store needs fsspec: pip install 'bentwing[fleet,s3]'"
        raise UsageError(msg) from None
    try:
        # A store has no folders that would have to be made first.
        options = {"auto_mkdir": True} if url.startswith(("file:", "local:")) else {}
        files, root = fsspec.core.url_to_fs(url, **options)
    except (ImportError, ValueError) as error:
        msg = f"{url}: cannot be read ({error}); for s3:// pip install 'bentwing[s3]'"
        raise UsageError(msg) from error
    return files, str(root).rstrip("/")


def _may_pass(error: Exception) -> bool:
    """Whether the same call may succeed later."""
    names = [kind.__name__ for kind in type(error).__mro__]
    if "FileExpired" in names:
        return False
    code = error.errno if isinstance(error, OSError) else None
    return code in _OF_SERVER or any(map(_OF_NETWORK.search, names))


def _described(url: str, error: Exception) -> Exception:
    """Return what is to be said of an error; one that is of no store stays as it is."""
    names = [kind.__name__ for kind in type(error).__mro__]
    if "FileExpired" in names:
        return ChangedError(
            f"{url}: was replaced while it was read; start again when nobody writes"
        )
    if isinstance(error, FileNotFoundError):
        return InputError(
            f"{url}: no such object or bucket ({error}); check the name and the region"
        )
    if isinstance(error, PermissionError):
        return InputError(
            f"{url}: the store allows no access ({error}); check the rights of the key"
        )
    if any("Credentials" in name for name in names):
        hint = "set AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, or a profile"
        return InputError(f"{url}: the store asks for a key ({error}); {hint}, on all workers")
    if isinstance(error, OSError) and error.errno == errno.ENOSPC:
        return InputError(f"{url}: the disk is full; let TMPDIR name a larger one")
    if _may_pass(error):
        return InputError(
            f"{url}: no connection with the store ({error}); start again, what is there stays"
        )
    if isinstance(error, OSError) or "BotoCoreError" in names:
        return InputError(f"{url}: the store refuses it ({error})")
    return error
