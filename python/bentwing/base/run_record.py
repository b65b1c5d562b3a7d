# SPDX-License-Identifier: MIT OR Apache-2.0
"""run.json: how a run folder is told from others, and its record as plain JSON types."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, FiniteFloat, ValidationError

from bentwing.base.errors import BentwingError, InputError, UsageError
from bentwing.base.provenance import describe_input
from bentwing.base.result_folder import RecordedFolder, is_plain_name
from bentwing.base.validation import describe

if TYPE_CHECKING:
    from collections.abc import Iterator

RECORD = "run.json"
EVALUATION_FOLDER = RecordedFolder("evaluation.json", "bentwing evaluation", "evaluation", "an")
RUN_FOLDER = RecordedFolder(
    RECORD, "bentwing run", "run", about=(("evaluation", EVALUATION_FOLDER),)
)

_Stamp = Annotated[int, Field(ge=-(2**62), le=2**62)]
_Span = tuple[FiniteFloat, FiniteFloat]
_Objects = list[dict[str, Any]]


class _Read(BaseModel):
    """What other commands read of a record; the rest is for people."""

    model_config = ConfigDict(extra="allow", strict=False)

    complete: bool = False
    files: list[str] = []
    hashes: dict[str, dict[str, Any]] = {}
    settings: dict[str, Any] = {}
    inputs: _Objects = []
    recordings: list[str] = []
    start_ns: _Stamp | None = None
    segments: list[_Span] | None = None
    windows: _Objects | None = None
    warnings: list[str] | None = None
    calibration: dict[str, Any] | None = None
    georeference: dict[str, Any] | None = None
    verdict: dict[str, Any] | None = None
    runs: _Objects | None = None


def read_record(run: Path) -> dict[str, Any]:
    """Record of the run in a folder.

    Raises
    ------
    UsageError
        If the folder holds no bentwing run.
    InputError
        If the record is damaged.
    """
    record = RUN_FOLDER.read(Path(run))
    if record is None:
        msg = f"{run}: holds no bentwing run ({RECORD} is missing or of another program)"
        raise UsageError(msg)
    try:
        _Read.model_validate(record)
    except ValidationError as error:
        msg = f"{describe(error, _Read, Path(run) / RECORD)}; it is damaged, map it again"
        raise InputError(msg) from None
    return record


def finished_record(run: Path) -> dict[str, Any]:
    """Record of a complete run whose files are those that it wrote.

    Raises
    ------
    UsageError
        If the folder holds no bentwing run, or one that is not complete.
    InputError
        If the record is damaged, or a file is not the one that the run wrote.
    """
    folder, record = Path(run), read_record(run)
    if not record.get("complete"):
        msg = f"{run}: the run is not complete; finish it with `bentwing map ... --resume` first"
        raise UsageError(msg)
    for name, written in record.get("hashes", {}).items():
        path = folder / name
        # A file that was taken away is missed where it is needed.
        if not is_plain_name(name) or not path.is_file():
            continue
        now = describe_input(path)
        if any(now[key] != written.get(key) for key in ("bytes", "sha256")):
            msg = (
                f"{path}: is not the file that the run wrote (its size or SHA-256 differs from "
                f"{RECORD}); put that back, or map it again"
            )
            raise InputError(msg)
    return record


@contextmanager
def understood(run: Path) -> Iterator[None]:
    """Turn what fails while a record is made into values into a sentence about the record.

    Raises
    ------
    InputError
    """
    try:
        yield
    except BentwingError:
        raise
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        what = f"{type(error).__name__}: {error}"
        msg = f"{Path(run) / RECORD}: is not as bentwing writes it ({what}); map it again"
        raise InputError(msg) from error
