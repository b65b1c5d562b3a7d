# SPDX-License-Identifier: MIT OR Apache-2.0
"""Control and check points on the first page: their residuals, and where they are on the plan."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.plan import Mark
from bentwing.report.sections import DASH, table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bentwing.report.frame import ShownFrame
    from bentwing.report.texts import Texts

_LEVEL, _UPRIGHT = 0.9, 0.3  # of the upward part of a normal: floors beyond, walls below


def marks_of(georeference: Mapping[str, Any] | None, frame: ShownFrame) -> list[Mark]:
    """Return the marks where the plan shows them."""
    rows = [row for row in _rows(georeference) if row.get("in_map") is not None]
    if not rows:
        return []
    places = frame.points(np.array([row["in_map"] for row in rows], np.float64))
    return [
        Mark(str(row["id"]), (float(x), float(y)), is_check=row["use"] == "check")
        for row, (x, y, _) in zip(rows, places, strict=True)
    ]


def marks_section(georeference: Mapping[str, Any] | None, texts: Texts) -> str:
    """Make the table of residuals with what they come to; empty without any."""
    rows = _rows(georeference)
    if not rows:
        return ""
    left = (georeference or {}).get("residuals") or {}
    said = [
        texts.say(text, n=found["n"], rms=1e3 * found["rms"], most=1e3 * found["max"])
        for use, text in (("control", texts.marks_control), ("check", texts.marks_check))
        if (found := left.get(use))
    ]
    return (
        f"<section><h2>{escape(texts.marks)}</h2><p><b>{escape(' '.join(said))}</b> "
        f"{escape(texts.marks_note)}{_of_spheres(rows, texts)}</p>{_table(rows, texts)}</section>"
    )


def _of_spheres(rows: Sequence[Mapping[str, Any]], texts: Texts) -> str:
    return f" {escape(texts.spheres_note)}" if any(r.get("kind") == "sphere" for r in rows) else ""


def _table(rows: Sequence[Mapping[str, Any]], texts: Texts) -> str:
    has_spheres = bool(_of_spheres(rows, texts))
    is_picked = any(row.get("picked_off") is not None for row in rows)
    cells = [
        (
            str(row["id"]),
            texts.uses.get(str(row["use"]), str(row["use"])),
            _across(row, texts),
            _millimetres(row["before"], texts),
            _millimetres(row["residual"], texts),
            *([_millimetres(row.get("sigma"), texts).lstrip("+")] if has_spheres else []),
            *([_millimetres(row.get("picked_off"), texts).lstrip("+")] if is_picked else []),
        )
        for row in rows
    ]
    head = (
        texts.mark, texts.use, texts.across, texts.before, texts.residual,
        *([texts.sigma] if has_spheres else []), *([texts.picked] if is_picked else []),
    )  # fmt: skip
    return table(head, cells, numbers=frozenset({3, 4, 5, 6}))


def _across(row: Mapping[str, Any], texts: Texts) -> str:
    if row.get("contradicts"):
        return texts.contradicts
    if row.get("kind") == "sphere":
        return texts.no_sphere if row["residual"] is None else texts.sphere
    normal = row["normal"]
    if normal is None:
        return texts.not_used if row.get("picked_off") is None else texts.only_seen
    upward = abs(normal[2])
    if upward > _LEVEL:
        return texts.heights
    return texts.sideways if upward < _UPRIGHT else texts.mixed


def _millimetres(value: float | None, texts: Texts) -> str:
    if value is None:
        return DASH
    rounded = round(1000 * value, 1)
    return texts.number(rounded, "+.1f" if rounded else ".1f")


def _rows(georeference: Mapping[str, Any] | None) -> Sequence[Mapping[str, Any]]:
    return (georeference or {}).get("control_points") or []
