# SPDX-License-Identifier: MIT OR Apache-2.0
"""What can be reproduced of which paper; another part joins with one line here."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.base.atomic import write_bytes, write_text
from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_folder
from bentwing.base.plain import plain
from bentwing.base.progress import Progress
from bentwing.base.provenance import bentwing_version
from bentwing.report.raster import rasterize
from bentwing.report.svg import standalone
from bentwing.reproduce.figure import Assignment
from bentwing.reproduce.flight import flight_part
from bentwing.reproduce.fu2023 import fu_part
from bentwing.reproduce.mapping import mapping_part
from bentwing.reproduce.page import page
from bentwing.reproduce.tazir2020 import tazir_part

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from bentwing.reproduce.figure import Part
    from bentwing.reproduce.names import PaperName, PartName

PARTS: dict[PaperName, dict[PartName, Callable[[Assignment], Part]]] = {
    "kaul2015": {"mapping": mapping_part, "flight": flight_part},
    "fu2023": {"mapping": fu_part},
    "tazir2020": {"mapping": tazir_part},
}


@dataclass(frozen=True, slots=True)
class Reproduced:
    """What was made, and the files that were written: one page, and the figures on it."""

    page: Path
    parts: list[Part]
    figures: list[Path]


def reproduce(
    paper: PaperName,
    out: Path,
    parts: Sequence[PartName] = (),
    *,
    quick: bool = False,
    seed: int = 1,
    progress: Progress | None = None,
) -> Reproduced:
    """Write report.html, the figures and the tables of a paper's parts (default: all) into `out`.

    Raises
    ------
    UsageError
        If there is no such paper or part, or nothing can be written there.
    """
    if paper not in PARTS:
        msg = f"{paper}: there is nothing of it to reproduce; there is {', '.join(PARTS)}"
        raise UsageError(msg)
    unknown = [part for part in parts if part not in PARTS[paper]]
    if unknown:
        msg = f"{paper} has no part {', '.join(unknown)}; it has {', '.join(PARTS[paper])}"
        raise UsageError(msg)
    require_folder(out)
    out.mkdir(parents=True, exist_ok=True)
    written = Reproduced(out / "report.html", [], [])
    for name in parts or PARTS[paper]:
        assignment = Assignment(out, quick, seed, progress or Progress())
        _write(out, name, PARTS[paper][name](assignment), written)
    scale = "quick: shorter flights than the paper's" if quick else "at the paper's size"
    subtitle = f"bentwing {bentwing_version()} · seed {seed} · {scale}"
    write_text(written.page, page(f"{paper}, reproduced", subtitle, written.parts))
    return written


def _write(out: Path, name: str, part: Part, written: Reproduced) -> None:
    # Where there is nothing to draw the page says so in words.
    drawn = [figure for figure in part.figures if figure.drawing.startswith("<svg")]
    for figure in drawn:
        path = out / f"{figure.name}.svg"
        write_text(path, standalone(figure.drawing))
        write_bytes(path.with_suffix(".png"), rasterize(figure.drawing))
        written.figures.append(path)
    if part.tables:
        write_text(out / f"{name}.md", "\n".join(table.markdown() for table in part.tables))
    write_text(out / f"{name}.json", json.dumps(plain(part.numbers), indent=1) + "\n")
    written.parts.append(part)
