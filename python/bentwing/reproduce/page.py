# SPDX-License-Identifier: MIT OR Apache-2.0
"""report.html: what was reproduced of a paper, one section per part."""

from __future__ import annotations

from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from bentwing.report.sections import DASH, table

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.reproduce.figure import Compared, Part, TextTable

MET = {True: "met", False: "missed", None: ""}


def page(title: str, subtitle: str, parts: Sequence[Part]) -> str:
    """Return a page that needs nothing beside it."""
    style = files("bentwing.report").joinpath("style.css").read_text(encoding="utf-8")
    sections = "".join(_section(part) for part in parts)
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head><body><main>"
        f"<header><h1>{escape(title)}</h1><p>{escape(subtitle)}</p></header>{sections}"
        "</main></body></html>\n"
    )


def _section(part: Part) -> str:
    figures = "".join(
        f"<figure>{f.drawing}<figcaption><b>{escape(f.title)}</b> {escape(f.note)}</figcaption></figure>"
        for f in part.figures
    )
    tables = "".join(map(_table, part.tables))
    compared = _compared(part.compared) if part.compared else ""
    return f'<h2>{escape(part.title)}</h2>{tables}{compared}<div class="grid">{figures}</div>'


def _table(shown: TextTable) -> str:
    note = f"<p>{escape(shown.note)}</p>" if shown.note else ""
    return f"<h3>{escape(shown.title)}</h3>{table(shown.head, shown.rows)}{note}"


def _compared(rows: Sequence[Compared]) -> str:
    head = ("", "paper", "bentwing, simulated", "aim", "")
    cells = [(r.what, r.paper, r.ours, r.aim or DASH, MET[r.met]) for r in rows]
    return table(head, cells, numbers=frozenset({3, 4})) + "<p></p>"
