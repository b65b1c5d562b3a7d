# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tables in Markdown, and numbers that are kept as JSON."""

from __future__ import annotations

import json
import time
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence
    from pathlib import Path


def head(columns: Sequence[str]) -> str:
    """The first two lines."""
    return f"{line(columns)}\n|{'---|' * len(columns)}"


def line(cells: Iterable[str]) -> str:
    """One row."""
    return f"| {' | '.join(cells)} |"


def given(value: float | None, factor: float, unit: str) -> str:
    """The value in a unit, or a dash where there is none."""
    return "-" if value is None else f"{value * factor:.2f} {unit}".rstrip()


def keep(entry: dict, path: Path) -> None:
    """Append an entry, with the time, to those that earlier runs have left."""
    path.parent.mkdir(parents=True, exist_ok=True)
    earlier = json.loads(path.read_text()) if path.exists() else []
    when = time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime())
    path.write_text(json.dumps([*earlier, {"when": when, **entry}], indent=1))
