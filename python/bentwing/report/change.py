# SPDX-License-Identifier: MIT OR Apache-2.0
"""What has changed since a map was made, as a table and as pictures: a plan, and the largest areas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.voxels import voxel_keys
from bentwing.report.colours import ints
from bentwing.report.picture import View, paint, project
from bentwing.report.plan import Mark, draw_plan
from bentwing.report.sections import capital, figure, table
from bentwing.report.svg import map_view
from bentwing.report.way import Way

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.map.change import Change
    from bentwing.report.drawn import Drawn
    from bentwing.report.frame import ShownFrame
    from bentwing.report.texts import Texts

    Array = NDArray[np.float64]

_GREY = ("b9bfc7", "b9bfc7")
_APPEARED, _DISAPPEARED = "d55e00", "0072b2"  # told apart by the colour-blind, too
_SHOWN = 6  # areas with a picture of their own
_AROUND = 1.5  # m, of the map that a picture shows around an area
_ABOVE = 100.0  # m by which changed points are lifted in a plan, so that nothing hides them
_LIFT = np.radians(40.0)  # of the eye above the horizon
_THICK = 0.1  # m; new points stand for all of the map that are so near


def change_table(areas: Sequence[Mapping[str, Any]], frame: ShownFrame, texts: Texts) -> str:
    """Make the table of areas that have changed."""
    if not areas:
        return f'<p class="none">{texts.unchanged}</p>'
    rows = []
    for number, one in enumerate(areas, start=1):
        x, y, _ = frame.points(np.array([one["centre"]]))[0] + frame.origin
        up = frame.place[2] + frame.origin[2] - frame.middle[2]
        heights = f"{one['low'] + up:.2f} to {one['high'] + up:.2f}"
        kind = texts.kinds[one["kind"]]
        rows.append((str(number), kind, f"{x:,.2f}", f"{y:,.2f}", heights, f"{one['area']:.2f}"))
    head = ("", texts.change, "x, m", "y, m", f"{texts.heights}, m", f"{texts.area}, m²")
    return table(head, rows, numbers=frozenset({0, 2, 3, 4, 5}))


def change_figures(change: Change, drawn: Drawn) -> str:
    """Draw the plan of all changes, and the largest areas one by one; empty where nothing has changed."""
    areas = drawn.record["localization"].get("changed_areas") or []
    if not areas or not len(drawn.points):
        return ""
    frame, texts = drawn.frame, drawn.texts
    appeared, gone = frame.points(change.appeared), frame.points(change.disappeared)
    low = drawn.points[drawn.points[:, 2] < _ceiling(drawn)]
    points = np.concatenate([low, appeared, gone])
    is_new = np.isin(voxel_keys(low, _THICK), voxel_keys(appeared, _THICK))
    kinds = np.concatenate([is_new, np.ones(len(appeared)), np.full(len(gone), 2)]).astype(np.intp)
    centres = frame.points(np.array([one["centre"] for one in areas]))
    plan = _plan(points, kinds, centres, drawn)
    figures = [figure(plan, texts.changes_plan, texts.changes_plan_note, wide=True)]
    for number, (one, centre) in enumerate(zip(areas[:_SHOWN], centres, strict=False), start=1):
        note = f"{texts.kinds[one['kind']]}, {one['area']:.1f} m²"
        drawing = _close_up(points, kinds, centre, float(one["area"]), drawn.trajectory.positions)
        figures.append(figure(drawing, f"{capital(texts.change)} {number}", note))
    return f'<div class="grid">{"".join(figures)}</div>'


def _ceiling(drawn: Drawn) -> float:
    ceiling = None if drawn.views is None else drawn.views.ceiling
    return np.inf if ceiling is None else ceiling


def _plan(points: Array, kinds: NDArray[np.intp], centres: Array, drawn: Drawn) -> str:
    x, y, z = points.T
    view = _painted(x, y, z + _ABOVE * (kinds > 0), kinds, 1100)
    marks = [
        Mark(str(number), (float(x), float(y)), is_check=None)
        for number, (x, y, _) in enumerate(centres, start=1)
    ]
    places, texts = drawn.trajectory.positions, drawn.texts
    key = [(_APPEARED, texts.kinds["appeared"]), (_DISAPPEARED, texts.kinds["disappeared"])]
    way = Way(places[:, 0], places[:, 1], None)
    return draw_plan(
        view,
        drawn.frame,
        way=way,
        marks=marks,
        table=_GREY,
        key=key,
        name=texts.changes_plan,
        texts=texts,
    )


def _close_up(
    points: Array, kinds: NDArray[np.intp], centre: Array, area: float, way: Array
) -> str:
    """Draw what is around an area, from above the side from which it was seen."""
    nearest = way[np.linalg.norm(way - centre, axis=1).argmin()] if len(way) else centre + 1.0
    level = nearest[:2] - centre[:2] + 1e-6
    to_eye = np.append(np.cos(_LIFT) * level / np.linalg.norm(level), np.sin(_LIFT))
    right = np.cross([0.0, 0.0, 1.0], to_eye) / np.cos(_LIFT)
    reach = _AROUND + np.sqrt(area)
    near = (np.abs(points[:, :2] - centre[:2]) < reach).all(axis=1)
    axes = np.stack([right, np.cross(to_eye, right), to_eye], axis=1)
    across, up, toward = ((points[near] - centre) @ axes).T
    view = _painted(across, up, toward, kinds[near], 700)
    return map_view(view, "", _GREY, name="Changed area", text_size=22)


def _painted(across: Array, up: Array, toward: Array, kinds: NDArray[np.intp], width: int) -> View:
    """Paint the map grey, and what has changed in its colour."""
    seen = project(across, up, toward, width=width, max_height=int(0.7 * width))
    view = paint(seen, np.zeros(len(across)), table=_GREY)
    what = np.where(seen.front >= 0, kinds[seen.front], 0)
    for kind, code in ((1, _APPEARED), (2, _DISAPPEARED)):
        light = 0.5 + 0.5 * seen.light[what == kind, None]
        view.image[what == kind] = light * ints(code)
    return view
