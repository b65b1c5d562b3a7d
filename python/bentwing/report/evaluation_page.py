# SPDX-License-Identifier: MIT OR Apache-2.0
"""evaluation.html: what an evaluation has measured, as one page with its figures."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

from bentwing.report.evaluation_rows import blocks_of
from bentwing.report.html_page import html_page
from bentwing.report.sections import capital, figure, table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.evaluate.evaluation import Evaluation

_CAPTIONS = {
    "trajectory_differences": ("Differences", "of the aligned trajectory from the reference"),
    "trajectory_over_time": (
        "Differences over time",
        "of the aligned trajectory from the reference",
    ),
    "trajectory_over_speed": ("Differences over speed", "with a robust line"),
    "drift_translation": (
        "Drift of the position",
        "by length of the way; boxes are the middle half",
    ),
    "drift_rotation": (
        "Drift of the orientation",
        "by length of the way; boxes are the middle half",
    ),
    "map_error_histogram": ("Distances of the map", "from the reference, along its normals"),
    "map_error": ("Distances on the map", "blue is in front of the reference, red behind it"),
    "point_spacing": ("Point spacing", "distance of each point from its nearest neighbour"),
    "wall_thickness": ("Wall thickness", "of flat patches, one standard deviation"),
    "revisits": ("Offset between visits", "of patches that were seen more than once"),
}
_WIDE = frozenset({"trajectory_over_time", "map_error"})


def evaluation_page(evaluation: Evaluation, drawings: Mapping[str, str], name: str) -> str:
    """Make the page.

    Parameters
    ----------
    drawings : as SVG by name
    name : of what was evaluated
    """
    parts = [f"<header><h1>Evaluation · {escape(name)}</h1></header>"]
    for title, rows, head in blocks_of(evaluation):
        numbers = frozenset(range(1, len(head))) if head else frozenset({1})
        cells = table(head or ("measure", "value", "note"), rows, numbers=numbers)
        parts.append(f"<section><h2>{escape(capital(title))}</h2>{cells}</section>")
    if evaluation.notes:
        notes = "".join(f"<li>{escape(capital(note))}.</li>" for note in evaluation.notes)
        parts.append(f"<section><h2>Notes</h2><ul>{notes}</ul></section>")
    figures = "".join(
        figure(drawing, *_CAPTIONS.get(kind, (kind.replace("_", " "), "")), wide=kind in _WIDE)
        for kind, drawing in sorted(drawings.items(), key=lambda d: d[0] not in _WIDE)
    )
    parts.append(f'<section><h2>Figures</h2><div class="grid">{figures}</div></section>')
    return html_page(f"Evaluation · {name}", "".join(parts))
