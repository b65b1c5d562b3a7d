# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page that `bentwing reproduce` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from bentwing.reproduce import Reproduced

_MET = {True: "[green]met[/green]", False: "[red]missed[/red]", None: ""}


def page(written: Reproduced) -> Iterator[RenderableType]:
    """Yield the parts of the page, top to bottom."""
    for made in written.parts:
        yield from (Text(shown.markdown()) for shown in made.tables)
        if made.compared:
            table = Table(title=made.title, title_justify="left", box=None)
            for heading in ("", "paper", "bentwing", "aim", ""):
                table.add_column(heading)
            for row in made.compared:
                table.add_row(row.what, row.paper, row.ours, row.aim, _MET[row.met])
            yield table
