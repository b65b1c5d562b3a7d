# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a report keeps for those who check the method: motion, estimate, calibration, settings, versions."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report import sections
from bentwing.report.beams import beams_section
from bentwing.report.calibration import calibration_table
from bentwing.report.loops import closing_table
from bentwing.report.plot import Series, line_plot
from bentwing.report.sections import figure
from bentwing.report.stretches import degenerate_spans

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.report.texts import Texts

Spin = tuple["NDArray[np.float64]", "NDArray[np.float64]"]


def engineering_section(
    record: Mapping[str, Any], trajectory: Trajectory, spin: Spin | None, texts: Texts
) -> str:
    """Fold everything technical away; on paper one sentence stands for it."""
    parts = [
        _motion(trajectory, spin, texts),
        _windows(record, texts),
        _closing(record, texts),
        f"<h2>{texts.phrase('Calibration of the sensor head')}</h2>{_calibrations(record)}",
        beams_section(record.get("beams"), texts),
        _record(record, texts),
    ]
    return (
        f'<details class="engineering"><summary><b>{escape(texts.engineering)}</b> '
        f"{escape(texts.engineering_note)}</summary>{''.join(parts)}</details>"
        f'<p class="onpaper">{escape(texts.engineering_print)}</p>'
    )


def _motion(trajectory: Trajectory, spin: Spin | None, texts: Texts) -> str:
    t, p = trajectory.times, trajectory.positions
    position = line_plot([Series(n, t, p[:, i]) for i, n in enumerate("xyz")], "time, s", "position, m")  # fmt: skip
    steps = slice(None, None, 10)  # speeds over a tenth of a second, without the vibration
    speed = np.linalg.norm(np.diff(p[steps], axis=0), axis=1) / np.maximum(np.diff(t[steps]), 1e-9)
    figures = [
        figure(position, texts.phrase("Position"), texts.phrase("of the IMU in the map")),
        figure(
            line_plot([Series("speed", t[steps][1:], speed)], "time, s", "speed, m/s"),
            texts.phrase("Speed"),
        ),
    ]
    if spin is not None:
        rate = line_plot([Series("rate", spin[0], np.degrees(spin[1]))], "time, s", "rate of turn, °/s", width=1140)  # fmt: skip
        note = "of the sensor head; where it stalls, the scanner sees one plane only"
        figures.append(figure(rate, texts.phrase("Rate of turn"), texts.phrase(note), wide=True))
    return f'<h2>{texts.phrase("Motion")}</h2><div class="grid">{"".join(figures)}</div>'


def _windows(record: Mapping[str, Any], texts: Texts) -> str:
    windows: Sequence[Mapping[str, Any]] = record.get("windows") or []
    if not windows:
        return ""
    t = _column(windows, "time")
    spans = degenerate_spans(windows)
    own, fixed = _column(windows, "n_matches"), _column(windows, "n_fixed_matches")
    matches = [Series("in the window", t, own), Series("to fixed views", t, fixed)]
    share = [Series("share", t, 100 * _column(windows, "inlier_share"))]
    residual = [Series("residual", t, _column(windows, "residual_rms"))]
    surfels = [Series("surfels", t, _column(windows, "n_surfels"))]
    figures = [
        figure(line_plot(matches, "time, s", "matches", bands=spans), texts.phrase("Matches"), "of surfaces, per window; red where a direction of motion was not seen"),
        figure(line_plot(share, "time, s", "inliers, %", top=100, bands=spans), texts.phrase("Inliers"), "matches that agree"),
        figure(line_plot(residual, "time, s", "residual over expected noise", bands=spans), texts.phrase("Residual"), "root mean square distance of matches over the expected noise of one point; a quarter is usual, as a piece of surface is the mean of many points"),
        figure(line_plot(surfels, "time, s", "surfels", bands=spans), texts.phrase("Surfels"), "pieces of surface seen per window"),
    ]  # fmt: skip
    notes = "".join(
        f"<p>{escape(sections.capital(str(n)))}.</p>" for n in record.get("notes") or []
    )
    return (
        f"<h2>{texts.phrase('Estimate, window by window')}</h2><p>{escape(sections.quality(windows))}</p>{notes}"
        f'<div class="grid">{"".join(figures)}</div>'
    )


def _closing(record: Mapping[str, Any], texts: Texts) -> str:
    asked = bool((record.get("settings") or {}).get("loop_closure"))
    return (
        f"<h2>{texts.phrase('Loops')}</h2>{closing_table(record.get('loop_closure'), asked=asked)}"
    )


def _calibrations(record: Mapping[str, Any]) -> str:
    runs = record.get("runs") or []
    if not runs:
        return calibration_table(record.get("calibration"))
    tables = [f"<h3>{escape(r['name'])}</h3>{calibration_table(r['calibration'])}" for r in runs]
    return "".join(tables)


def _record(record: Mapping[str, Any], texts: Texts) -> str:
    settings, versions = record.get("settings") or {}, record.get("versions") or {}
    timings = record.get("timings") or {}
    blocks = [
        ("Counts", sections.mapping_table(("what", "number"), record.get("counts") or {})),
        ("Clocks", sections.mapping_table(("of", "value"), record.get("clocks") or {})),
        ("Time and memory", sections.timings_table(timings, record.get("peak_memory_mb"))),
        ("Versions", _named(("of", "version"), versions)),
    ]
    cells = "".join(f"<div><h3>{texts.phrase(name)}</h3>{html}</div>" for name, html in blocks)
    inputs = sections.inputs_table(record.get("inputs") or [])
    return (
        f'<h2>{texts.phrase("Record")}</h2><div class="grid">{cells}</div>'
        f"<h3>{texts.phrase('Settings')}</h3>{_named(('setting', 'value'), settings)}"
        f"<h3>{texts.phrase('Inputs')}</h3>{inputs}"
    )


def _named(head: tuple[str, str], values: Mapping[str, Any]) -> str:
    return sections.mapping_table(head, values, are_amounts=False)


def _column(windows: Sequence[Mapping[str, Any]], name: str) -> NDArray[np.float64]:
    values = [window.get(name) for window in windows]
    return np.array([np.nan if value is None else float(value) for value in values])
