# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a report shows for what its first page says: the map, its coverage, its agreement with itself."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from bentwing.evaluate.thickness import wall_thickness
from bentwing.report.loops import consistency_table, revisits_table
from bentwing.report.scene import scene
from bentwing.report.sections import figure, refinement_sentence
from bentwing.report.views import SLAB

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from bentwing.evaluate.revisits import Revisits
    from bentwing.report.drawn import Drawn
    from bentwing.report.texts import Texts


def map_section(drawn: Drawn, values: NDArray[np.float32] | None = None) -> str:
    """Show the map from all sides, and to turn; coloured by `map.sample.VALUES` (N, 3) as well."""
    record, views, texts = drawn.record, drawn.views, drawn.texts
    if views is None:
        is_wanted = (record.get("settings") or {}).get("writes_map", True)
        why = texts.no_points if is_wanted else texts.no_map
        return f'<h2>{escape(texts.map)}</h2><p class="none">{escape(why)}</p>'
    figures = [
        scene(
            drawn.points,
            drawn.times,
            drawn.trajectory,
            record.get("windows") or [],
            ceiling=views.ceiling,
            frame=drawn.frame,
            values=values,
            texts=texts,
        ),
        figure(views.oblique, texts.oblique, texts.oblique_note, wide=True),
        figure(views.plan_time, texts.by_time, texts.by_time_note, wide=True),
        figure(views.side, texts.side, texts.side_note, wide=True),
        figure(views.section, texts.section, texts.say(texts.section_note, slab=SLAB), wide=True),
    ]
    said = refinement_sentence((record.get("map") or {}).get("refinement"), texts)
    return f'<h2>{escape(texts.map)}</h2>{said}<div class="grid">{"".join(figures)}</div>'


def coverage_section(drawn: Drawn) -> str:
    """Show how densely and how often each part of the site was measured."""
    found, texts = drawn.coverage, drawn.texts
    if found is None:
        return ""
    density = texts.say(texts.density_note, cell=found.cell, median=found.median_density)
    visits = texts.say(texts.visits_note, area=found.area, again=100 * found.share_again)
    figures = figure(found.density, texts.density, density) + figure(
        found.visits, texts.visits, visits
    )
    return f'<h2>{escape(texts.coverage)}</h2><div class="grid">{figures}</div>'


def agreement_section(
    points: NDArray[Any], times: NDArray[Any], revisits: Revisits | None, texts: Texts
) -> str:
    """Show how well the map agrees with itself: what is known without any reference."""
    if not len(points):
        return ""
    try:
        walls = wall_thickness(points, times)
    except ValueError:
        walls = None
    loops = revisits_table(revisits, None if walls is None else walls.median, texts)
    return (
        f"<section><h2>{escape(texts.agreement)}</h2>{consistency_table(walls, revisits, texts)}"
        f"<h3>{escape(texts.visited_again)}</h3>{loops}</section>"
    )
