# SPDX-License-Identifier: MIT OR Apache-2.0
"""The first page of a report: for whom, what was measured, whether it can be used, and how exact it is."""

from __future__ import annotations

from datetime import datetime
from html import escape
from typing import TYPE_CHECKING, Any

from bentwing.recording.sections.project import project_in
from bentwing.report import facts, sections
from bentwing.report.marks import marks_section
from bentwing.report.stretches import degenerate_spans, spans_sentence

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.report.drawn import Drawn
    from bentwing.report.texts import Texts
    from bentwing.report.views import MapViews


def title_of(record: Mapping[str, Any], texts: Texts) -> str:
    """Name the report."""
    project = project_in(record)
    named = "" if project is None else project.name
    return f"{texts.title} · {named or facts.subject(record)}"


def cover(drawn: Drawn) -> str:
    """Make the first page."""
    record, texts = drawn.record, drawn.texts
    rows = facts.job(record, drawn.trajectory, texts)
    cells = "".join(f"<dt>{escape(name)}</dt><dd>{escape(value)}</dd>" for name, value in rows)
    parts = [
        f"<header><h1>{escape(title_of(record, texts))}</h1>{_made(record, texts)}</header>",
        f'<div class="front"><dl>{cells}</dl>{sections.verdict(record, texts)}</div>',
        sections.tiles(record, drawn.trajectory, drawn.points, drawn.coverage, texts),
    ]
    if drawn.views is not None:
        surveyed = marks_section(record.get("georeference"), texts)
        kind = "surveyed" if surveyed else "plan"
        parts += [
            f'<div class="{kind}">{_plan(record, drawn.views, texts)}{surveyed}</div>',
            _words(texts.coordinates, facts.coordinates(record, texts)),
            _words(texts.left_out, _left_out(record, texts)),
        ]
    return f'<section class="cover">{"".join(parts)}</section>'


def _made(record: Mapping[str, Any], texts: Texts) -> str:
    version = (record.get("versions") or {}).get("bentwing", "")
    when = record.get("started")
    started = datetime.fromisoformat(str(when)) if when else None
    said = "" if started is None else f"{started.strftime(texts.date)} {started:%H:%M:%S %Z}"
    return f"<p>{escape(f'{texts.made} {said} · bentwing {version}')}</p>"


def _plan(record: Mapping[str, Any], views: MapViews, texts: Texts) -> str:
    marks = _marks(record)
    said = [
        texts.plan_note,
        _grid(record, views, texts),
        texts.plan_roof if views.ceiling is not None else "",
        texts.plan_marks if marks else "",
        spans_sentence(degenerate_spans(record.get("windows") or []), texts),
    ]
    note = " ".join(sentence for sentence in said if sentence)
    return sections.figure(views.plan, texts.plan, note)


def _marks(record: Mapping[str, Any]) -> bool:
    return bool((record.get("georeference") or {}).get("control_points"))


def _grid(record: Mapping[str, Any], views: MapViews, texts: Texts) -> str:
    """Say whose coordinates the grid of the plan has."""
    if views.is_north_up:
        return texts.plan_north
    return texts.plan_site if (record.get("georeference") or {}).get("mode") else texts.plan_local


def _left_out(record: Mapping[str, Any], texts: Texts) -> str:
    counts = record.get("counts") or {}
    said = facts.left_out(record, texts)
    if not said:
        return texts.left_none
    total, written = counts.get("lidar.returns"), counts.get("map.written")
    lead = texts.say(texts.of_returns, n=total, written=written) if total and written else ""
    return f"{lead} {'; '.join(said)}.".strip()


def _words(name: str, sentence: str) -> str:
    return f'<p class="said"><b>{escape(name)}</b> {escape(sentence)}</p>'
