# SPDX-License-Identifier: MIT OR Apache-2.0
"""The sensor heads of public data sets, which come with bentwing as payload files.

Each file names the sources of its topics, transform and noise, and says which way the transform goes.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from bentwing.base.errors import PayloadError

PREFIX = "dataset:"
FOLDER = Path(__file__).parent / "datasets"


class ReadyPayload(NamedTuple):
    """A payload that comes with bentwing.

    Attributes
    ----------
    name : behind `dataset:`
    title : data set, carrier and sensors
    path : its file
    """

    name: str
    title: str
    path: Path


def ready_payloads() -> list[ReadyPayload]:
    """Return the payloads that come with bentwing, by name."""
    found = []
    for path in sorted(FOLDER.glob("*.yaml"), key=lambda path: path.stem):
        with path.open(encoding="utf-8") as file:
            found.append(ReadyPayload(path.stem, file.readline().removeprefix("#").strip(), path))
    return found


def payload_path(given: Path | str) -> Path:
    """Return the file of a payload, which `dataset:NAME` names where it comes with bentwing.

    Raises
    ------
    PayloadError
        No payload of that name comes with bentwing; with those that do.
    """
    text = str(given)
    if not text.startswith(PREFIX):
        return Path(given)
    ready = {one.name: one.path for one in ready_payloads()}
    name = text.removeprefix(PREFIX)
    if name not in ready:
        msg = f"{text}: no such payload comes with bentwing; give one of {', '.join(ready)}, or a file"
        raise PayloadError(msg)
    return ready[name]
