# SPDX-License-Identifier: MIT OR Apache-2.0
"""By how much the beams of a multi-beam lidar are off, as pictures and a table."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.plot import Series, line_plot
from bentwing.report.sections import table
from bentwing.report.texts import ENGLISH

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.report.texts import Texts

DEGREES, MILLIMETRES = 180 / np.pi, 1e3
_SCALES = np.array([DEGREES, DEGREES, MILLIMETRES, MILLIMETRES])


def beams_section(found: Mapping[str, Any] | None, texts: Texts = ENGLISH) -> str:
    """Draw what was found of the beams; nothing where they are as recorded."""
    if not found:
        return ""
    offsets, std = (np.array(found[name]) * _SCALES for name in ("offsets", "std"))
    elevations = np.array(found["table"]) * DEGREES
    before, after = (MILLIMETRES * value for value in found["roughness"])
    said = (
        "The beams of the lidar are not where the recording has them. What is given here was added to "
        f"every return: {found['n_returns']:,} returns from {found['n_planes']:,} planes scatter by "
        f"{after:.0f} mm instead of {before:.0f} mm. Heights are those of where the rays begin."
    )
    order = np.argsort(elevations)
    at, sorted_offsets = elevations[order], offsets[order]
    angles = [Series(n, at, sorted_offsets[:, i]) for i, n in enumerate(("elevation", "azimuth"))]
    lengths = [Series(n, at, sorted_offsets[:, i]) for i, n in ((2, "range"), (3, "height"))]
    figures = "".join(
        f"<figure>{line_plot(series, 'elevation as recorded, °', label)}"
        f"<figcaption><b>{texts.phrase(caption)}</b></figcaption></figure>"
        for series, label, caption in (
            (angles, "off by, °", "Angles of the beams"),
            (lengths, "off by, mm", "Ranges and heights of the beams"),
        )
    )
    rows = [
        (str(i), f"{elevations[i]:.2f}", *(_pm(offsets[i, c], std[i, c], d) for c, d in _DIGITS))
        for i in range(len(offsets))
    ]
    head = ("beam", "elevation, °", "elevation +, °", "azimuth +, °", "range +, mm", "height +, mm")
    listed = table(head, rows, numbers=frozenset(range(6)))
    return (
        f'<h2>{texts.phrase("Beams of the lidar")}</h2><p>{escape(said)}</p><div class="grid">{figures}'
        f'<div class="wide">{listed}</div></div>'
    )


_DIGITS = ((0, 3), (1, 3), (2, 1), (3, 1))


def _pm(value: float, sigma: float, digits: int) -> str:
    return f"{value:+.{digits}f} ± {sigma:.{digits}f}"
