# SPDX-License-Identifier: MIT OR Apache-2.0
"""How the map was put into its coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.sections import MINUS, shares_table, table
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bentwing.report.sections import Row
    from bentwing.report.texts import Texts

_TOLD = {
    "messages", "fixes", "used", "rejected", "rms_horizontal", "rms_vertical", "runs", "leap_seconds",
}  # fmt: skip
_QUALITY = "of_quality_"


def on_earth_section(found: Mapping[str, Any] | None, texts: Texts = ENGLISH) -> str:
    """Make the table of place, heading and fixes; empty where the map is in its own frame."""
    if not found:
        return ""
    fixes = found.get("fixes") or {}
    rows = [*_place(found), *_fixes(fixes), *_antennas(found.get("antennas") or [])]
    if "bent_by" in found:
        rows.append(
            ("way bent towards fixes and marks by at most", f"{1e3 * found['bent_by']:.0f} mm")
        )
    shares = ""
    if fixes.get("runs"):
        shares = f"<h3>{texts.phrase('GNSS fixes of the runs')}</h3>{shares_table(fixes['runs'])}"
    name = "Place on the Earth" if "epsg" in found else "Place in the frame of the control points"
    return (
        f"<section><h2>{texts.phrase(name)}</h2>{table(('what', 'value'), rows)}{shares}</section>"
    )


def _place(found: Mapping[str, Any]) -> list[Row]:
    rows: list[Row] = []
    if "heading" in found:
        turn = f"{np.degrees(found['heading']):.3f}° from east to north".replace("-", MINUS)
        if "std" in found:
            turn += f", standard deviation {np.degrees(found['std']['heading']):.3f}°"
        rows.append(("direction of the x axis that the map had", turn))
    if "std" in found:
        east, north, up = (1e3 * s for s in found["std"]["translation"])
        said = f"{east:.1f} mm east, {north:.1f} mm north, {up:.1f} mm up"
        rows.append(("standard deviation of the place", said))
    if "point_scale" in found:
        rows += [
            ("meridian convergence", f"{found['convergence_deg']:.4f}°"),
            ("point scale of the projection", f"{found['point_scale']:.6f}"),
        ]
    return rows


def _antennas(antennas: Sequence[Mapping[str, Any]]) -> list[Row]:
    """Say where the fixes have those antennas that the payload leaves to them."""
    return [
        (
            f"antenna{of} in the IMU frame, by the fixes",
            ", ".join(
                f"{name} {metres:.3f} ± {std:.3f} m".replace("-", MINUS)
                for name, metres, std in zip("xyz", one["lever_arm"], one["std"], strict=True)
            ),
        )
        for one in antennas
        if one["used"]
        for of in [f" of {one['run']}" if one["run"] else ""]
    ]


def _fixes(fixes: Mapping[str, Any]) -> list[Row]:
    if "used" not in fixes:
        return []
    rows: list[Row] = [
        ("GNSS fixes", f"{fixes['used']:,} used, {fixes['rejected']:,} left out"),
        (
            "distance of the map from the fixes, root mean square",
            f"{1e3 * fixes['rms_horizontal']:.0f} mm horizontally, "
            f"{1e3 * fixes['rms_vertical']:.0f} mm vertically",
        ),
    ]
    unusable = {
        name.replace("_", " "): n
        for name, n in fixes.items()
        if name not in _TOLD and not name.startswith(_QUALITY) and isinstance(n, int) and n
    }
    kinds = [
        f"{n:,} {k.removeprefix(_QUALITY)}" for k, n in fixes.items() if k.startswith(_QUALITY)
    ]
    if kinds:
        rows.append(("kinds of solutions", ", ".join(kinds)))
    if fixes.get("leap_seconds"):
        rows.append(
            (
                "seconds by which the times of the fixes were ahead of UTC",
                str(fixes["leap_seconds"]),
            )
        )
    if unusable:
        said = ", ".join(f"{n:,} with {name}" for name, n in unusable.items())
        rows.append(("GNSS messages that could not be used", said))
    return rows
