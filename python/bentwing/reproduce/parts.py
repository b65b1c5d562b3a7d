# SPDX-License-Identifier: MIT OR Apache-2.0
"""What can be reproduced of which paper; another part joins with one line here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING

from bentwing.atomic import write_text
from bentwing.errors import UsageError
from bentwing.reproduce.flight import flight_part

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from bentwing.reproduce.figure import Part

PARTS: dict[str, dict[str, Callable[[bool], Part]]] = {"kaul2015": {"flight": flight_part}}


@dataclass(frozen=True, slots=True)
class Reproduced:
    """Files that were written: a page per part and the figures on it."""

    pages: list[Path]
    figures: list[Path]


def reproduce(
    paper: str, out: Path, parts: Sequence[str] = (), *, quick: bool = False
) -> Reproduced:
    """Write the pages and figures of a paper's parts (all by default) into the folder `out`.

    Raises
    ------
    UsageError
        If there is no such paper or part.
    """
    if paper not in PARTS:
        msg = f"{paper}: there is nothing of it to reproduce; there is {', '.join(PARTS)}"
        raise UsageError(msg)
    unknown = [part for part in parts if part not in PARTS[paper]]
    if unknown:
        msg = f"{paper} has no part {', '.join(unknown)}; it has {', '.join(PARTS[paper])}"
        raise UsageError(msg)
    out.mkdir(parents=True, exist_ok=True)
    written = Reproduced([], [])
    for name in parts or PARTS[paper]:
        _write(out, name, PARTS[paper][name](quick), written)
    return written


def _write(out: Path, name: str, part: Part, written: Reproduced) -> None:
    for figure in part.figures:
        path = out / f"{figure.name}.svg"
        write_text(path, figure.drawing)
        written.figures.append(path)
    write_text(out / f"{name}.json", json.dumps(part.numbers, indent=1) + "\n")
    page = out / f"{name}.html"
    write_text(page, _page(part))
    written.pages.append(page)


def _page(part: Part) -> str:
    style = files("bentwing.report").joinpath("style.css").read_text(encoding="utf-8")
    figures = "".join(
        f"<figure>{f.drawing}<figcaption><b>{escape(f.title)}</b> {escape(f.note)}</figcaption></figure>"
        for f in part.figures
    )
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        f"<title>{escape(part.title)}</title><style>{style}</style></head><body><main>"
        f'<header><h1>{escape(part.title)}</h1></header><div class="grid">{figures}</div>'
        "</main></body></html>\n"
    )
