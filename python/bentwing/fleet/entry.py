# SPDX-License-Identifier: MIT OR Apache-2.0
"""One recording of many: its files, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.fleet.stored import Stored


@dataclass(frozen=True, slots=True)
class Entry:
    """A recording that is to be mapped.

    Attributes
    ----------
    name : of its run folder; no two are the same
    parts : files that are one recording, here or in a store
    payload : description of the sensor head; None where nothing describes it
    project : YAML file of what the report names
    marks : CSV file of control points
    start : s to skip
    """

    name: str
    parts: tuple[Path | Stored, ...]
    payload: Path | None = None
    project: Path | None = None
    marks: Path | None = None
    start: float | None = None
