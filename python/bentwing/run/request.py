# SPDX-License-Identifier: MIT OR Apache-2.0
"""What was asked of a run, as one hash: two runs of the same request have the same bytes."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import BentwingError
from bentwing.base.plain import plain
from bentwing.base.provenance import bentwing_version, describe_input, files_of
from bentwing.base.run_record import finished_record

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from bentwing.run.settings import MapSettings, RunSettings

# The number of threads and names in the report change no bit of a trajectory or a map.
_FREE = frozenset({"threads", "project"})


def deciding(settings: MapSettings) -> dict[str, Any]:
    """Return the settings that decide the bytes of a result, in plain JSON types."""
    return {name: value for name, value in settings.to_json().items() if name not in _FREE}


def request_of(settings: RunSettings, inputs: Iterable[Mapping[str, Any]]) -> str:
    """Return the SHA-256 of settings as they were given, of inputs, and of the version.

    Parameters
    ----------
    settings : before a head was found in the recording
    inputs : name, size and hash of each file, as run.json has them
    """
    on_earth = settings.georeferencing
    read = {"control_points": on_earth.control_points, "fixes": on_earth.fixes}
    files = {name: None if path is None else describe_input(path) for name, path in read.items()}
    return digest_of({"settings": deciding(settings), "inputs": list(inputs), **files})


def digest_of(asked: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what was asked of this version."""
    text = json.dumps(plain({**asked, "bentwing": bentwing_version()}), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def request_in(record: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what was asked of a finished run, from which all of its bytes follow."""
    # Earlier versions did not note it; what they have found stands for it.
    return str(record.get("request") or digest_of(record))


def inputs_of(paths: Iterable[Path]) -> list[dict[str, Any]]:
    """Return name, size and hash of files, folders standing for theirs."""
    return [describe_input(file) for path in paths for file in files_of(path)]


def record_of_request(
    run: Path, request: str, recordings: Sequence[str] | None
) -> dict[str, Any] | None:
    """Return the record of the complete run in a folder, None unless it is of this request.

    Parameters
    ----------
    recordings : where the recording lies, as run.json has it, for a merging reads it again there; None
        for a merged map, which has those of its runs
    """
    try:
        record = finished_record(run)
    except BentwingError:  # no run, an unfinished one, or one with other files than it wrote
        return None
    if record.get("request") != request:
        return None
    is_there = recordings is None or record.get("recordings") == list(recordings)
    return record if is_there else None
