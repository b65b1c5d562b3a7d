# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a reproduced part is asked for, and what it consists of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from bentwing.base.progress import Progress

if TYPE_CHECKING:
    from pathlib import Path


@dataclass(frozen=True, slots=True)
class Assignment:
    """What a part is asked for.

    Attributes
    ----------
    out : folder, for what a part keeps beside its figures
    quick : less of everything
    seed : of all that is random
    progress : what to tell the user meanwhile
    """

    out: Path
    quick: bool = False
    seed: int = 1
    progress: Progress = field(default_factory=Progress)


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing as SVG, the name of its file, a title, and what it shows beside the paper's."""

    name: str
    drawing: str
    title: str
    note: str


@dataclass(frozen=True, slots=True)
class Compared:
    """A figure of the paper beside ours.

    Attributes
    ----------
    what : is measured, with unit
    paper, ours : as text
    aim : what ours shall be, empty without one
    met : whether it is; None without an aim
    """

    what: str
    paper: str
    ours: str
    aim: str = ""
    met: bool | None = None


@dataclass(frozen=True, slots=True)
class TextTable:
    """A table of the paper with ours beside it: title, names of the columns, rows, and a remark."""

    title: str
    head: tuple[str, ...]
    rows: list[tuple[str, ...]]
    note: str = ""

    def markdown(self) -> str:
        """Return the table as Markdown."""
        lines = [f"| {' | '.join(row)} |" for row in (self.head, *self.rows)]
        lines.insert(1, f"|{'---|' * len(self.head)}")
        note = [self.note, ""] if self.note else []
        return "\n".join([f"**{self.title}**", "", *lines, "", *note])


@dataclass(frozen=True, slots=True)
class Part:
    """Figures on one page, the comparison with the paper, and the numbers behind them."""

    title: str
    figures: list[Figure]
    numbers: dict[str, Any] = field(default_factory=dict)
    compared: list[Compared] = field(default_factory=list)
    tables: list[TextTable] = field(default_factory=list)
