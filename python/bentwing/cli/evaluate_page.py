# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page that `bentwing evaluate` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table

from bentwing.report.evaluation_rows import blocks_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from rich.console import RenderableType

    from bentwing.evaluate.evaluation import Evaluation
    from bentwing.report.evaluation_rows import Block


def page(result: Evaluation) -> Iterator[RenderableType]:
    """Yield the parts of the page, top to bottom."""
    yield from map(_table, blocks_of(result))
    yield from (f"[yellow]note[/yellow]  {escape(note)}" for note in result.notes)


def table_of(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Return a table of several runs."""
    table = Table(box=None)
    for k, heading in enumerate(head):
        # the unit stands below, as there are many columns
        table.add_column(escape(heading.replace(", ", "\n")), justify="right" if k else "left")
    for row in rows:
        table.add_row(*map(escape, row))
    return table


def _table(block: Block) -> Table:
    has_head = bool(block.head)
    table = Table(title=block.title, title_justify="left", box=None, show_header=has_head)
    if has_head:
        for heading in block.head:
            table.add_column(heading, justify="right")
    else:
        table.add_column()
        table.add_column(justify="right")
        table.add_column(style="dim")
    for row in block.rows:
        table.add_row(*map(escape, row))
    return table
