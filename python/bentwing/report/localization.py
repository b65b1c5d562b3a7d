# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where a recording is in a given map, how well that is known, and what has changed since."""

from __future__ import annotations

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.report.change import change_figures, change_table
from bentwing.report.sections import DASH, Row, table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.map.change import Change
    from bentwing.report.drawn import Drawn


def localization_section(drawn: Drawn, change: Change | None) -> str:
    """Make the tables of place and changes, with pictures of these; empty of other runs."""
    found: Mapping[str, Any] | None = drawn.record.get("localization")
    if not found:
        return ""
    rows = [*_recognized(found), *_place(drawn), *_registered(drawn.record), *_beyond(found)]
    parts = [
        f"<section><h2>{escape(drawn.texts.localization)}</h2>",
        table(("what", "value"), rows),
        "</section>",
    ]
    if change is not None:
        said = escape(drawn.texts.changes_note)
        parts += [
            f"<section><h2>{escape(drawn.texts.changes)}</h2><p>{said}</p>",
            change_table(found.get("changed_areas") or [], drawn.frame, drawn.texts),
            change_figures(change, drawn),
            "</section>",
        ]
    return "".join(parts)


def _recognized(found: Mapping[str, Any]) -> list[Row]:
    name = Path(str(found.get("map", ""))).name
    rows: list[Row] = [
        ("given map", f"{name}, {found['map_points']:,} points, {found['map_places']} places"),
    ]
    tried = found.get("candidates") or []
    agreeing = [tried[k] for k in found.get("supporters") or []]
    known = len({tuple(one.get("span") or ()) for one in agreeing})
    of = f"{known} of {found['places']}"
    if agreeing:
        of += f"; {len(agreeing)} pairs with places of the map agree on where the recording is"
    rows.append(("places of the recording that were recognized", of))
    if "largest_deformation" in found:
        apart = f"{1e3 * found['largest_deformation']:.0f} mm"
        rows.append(("distance of these places from one common pose, at most", apart))
    return rows


def _place(drawn: Drawn) -> list[Row]:
    poses = drawn.trajectory
    if not len(poses.times):
        return []
    rows: list[Row] = []
    for name, k in (("begin of the way", 0), ("end of the way", -1)):
        ahead = geometry.to_matrices(poses.quats_xyzw[[k]])[0][:, 0]
        heading = np.degrees(np.arctan2(ahead[1], ahead[0]))
        x, y, z = poses.positions[k] + drawn.frame.origin
        rows.append(
            (
                name,
                f"x {x:,.3f}, y {y:,.3f}, z {z:.3f} m, x axis of the IMU {heading:.2f}° from x to y",
            )
        )
    return rows


def _registered(record: Mapping[str, Any]) -> list[Row]:
    """Say how well the place is known."""
    rows: list[Row] = []
    accuracy, closing = record.get("expected_accuracy"), record.get("loop_closure") or {}
    if closing.get("applied"):
        said = (
            f"{100 * closing['inlier_share']:.1f} % of the matches agree; the way moved by "
            f"{1e3 * closing['largest_translation']:.1f} mm at most"
        )
    else:
        said = f"places alone say where it is: {closing.get('reason') or 'it was not registered'}"
    rows.append(("registration with the map", said))
    if accuracy:
        said = (
            f"{1e3 * accuracy['horizontal']:.1f} mm horizontally, {1e3 * accuracy['vertical']:.1f} mm "
            f"vertically, {np.degrees(accuracy['heading']):.3f}° in heading; errors of the map come on top"
        )
    else:
        said = f"{DASH} (this estimator states none)"
    rows.append(("uncertainty of the least certain pose (68 %)", said))
    return rows


def _beyond(found: Mapping[str, Any]) -> list[Row]:
    if not found.get("points"):
        return []
    share = 100 * found["points_beyond_map"] / found["points"]
    what = "points where the map has nothing, and nobody knows whether something was there"
    return [(what, f"{share:.1f} %")]
