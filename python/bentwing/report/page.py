# SPDX-License-Identifier: MIT OR Apache-2.0
"""report.html: one file that shows what a run found and opens anywhere, without a network."""

from __future__ import annotations

from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.evaluate.expected import ExpectedAccuracy
from bentwing.evaluate.map import wall_thickness
from bentwing.report import sections
from bentwing.report.beams import beams_section
from bentwing.report.calibration import calibration_table
from bentwing.report.coverage import draw_coverage
from bentwing.report.loops import closing_table, consistency_table, revisits_table
from bentwing.report.merging import merging_section
from bentwing.report.plot import Series, line_plot
from bentwing.report.scene import scene
from bentwing.report.stretches import degenerate_spans, spans_sentence
from bentwing.report.views import SLAB, draw_views

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.revisits import Revisits

Spin = tuple["NDArray[np.float64]", "NDArray[np.float64]"]


def write_report(
    path: Path,
    *,
    run_json: Mapping[str, Any],
    trajectory: Trajectory,
    map_sample: tuple[NDArray[np.float64], NDArray[np.float64]],
    revisits: Revisits | None = None,
    spin: Spin | None = None,
) -> None:
    """Write the report of a run.

    Parameters
    ----------
    path : file to write, atomically
    run_json : the record of the run, as in run.json
    trajectory : of the IMU in the map; may be empty after a failure
    map_sample : points (N, 3) m in the map and their times (N,) s; may be empty
    revisits : how well what was seen twice agrees in the map
    spin : times (M,) s and rate of turn (M,) rad/s of the sensor head
    """
    points, times = map_sample
    title = f"Mapping report · {_subject(run_json)}"
    parts = [
        _header(title, run_json),
        sections.verdict(run_json),
        sections.tiles(run_json, trajectory, points),
        _maps(points, times, trajectory, run_json),
        merging_section(run_json.get("merging")),
        _georeference(run_json.get("georeference")),
        _coverage(points, times, run_json),
        _accuracy(points, revisits, run_json),
        _motion(trajectory, spin),
        _windows(run_json.get("windows") or []),
        f"<h2>Calibration of the sensor head</h2>{_calibrations(run_json)}",
        beams_section(run_json.get("beams")),
        _record(run_json),
    ]
    style = files("bentwing.report").joinpath("style.css").read_text(encoding="utf-8")
    page = (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{style}</style></head>"
        f"<body><main>{''.join(parts)}</main></body></html>\n"
    )
    write_text(path, page)


def _subject(record: Mapping[str, Any]) -> str:
    maps = (record.get("merging") or {}).get("maps") or []
    runs = [str(run) for one in maps for run in one["runs"]]
    if runs:
        return f"{', '.join(runs[:3])}{' …' if len(runs) > 3 else ''}"
    names = [str(item["name"]) for item in record.get("inputs") or []]
    recordings = [name for name in names if not name.endswith((".yaml", ".yml"))]
    return ", ".join(recordings[:3]) + (" …" if len(recordings) > 3 else "") or "recording"


def _header(title: str, record: Mapping[str, Any]) -> str:
    version = (record.get("versions") or {}).get("bentwing", "")
    started = str(record.get("started") or "").replace("T", " ").replace("+00:00", " UTC")
    return f"<header><h1>{escape(title)}</h1><p>bentwing {escape(version)} · {escape(started)}</p></header>"


def _maps(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    record: Mapping[str, Any],
) -> str:
    windows: Sequence[Mapping[str, Any]] = record.get("windows") or []
    if not len(points):
        is_wanted = (record.get("settings") or {}).get("writes_map", True)
        why = "No points were mapped." if is_wanted else "No map was asked for."
        return f'<h2>Map</h2><p class="none">{why}</p>'
    views = draw_views(points, times, trajectory, windows)
    seen = spans_sentence(degenerate_spans(windows))
    figures = [
        scene(points, times, trajectory, windows),
        _figure(views.oblique, "Oblique view", "coloured by height", wide=True),
        _figure(views.plan_height, "Plan", f"by height, with the path of the sensor (circle: start). {seen} {views.plan_note}"),
        _figure(views.plan_time, "Plan by time", "colours side by side that differ strongly are places seen again later; doubled walls there would be drift."),
        _figure(views.side, "Side view", "along the longer extent of the map", wide=True),
        _figure(views.section, "Section", f"{SLAB:g} m thick, through the middle of the path", wide=True),
    ]  # fmt: skip
    said = sections.refinement_sentence((record.get("map") or {}).get("refinement"))
    return f'<h2>Map</h2>{said}<div class="grid">{"".join(figures)}</div>'


def _coverage(
    points: NDArray[np.float64], times: NDArray[np.float64], record: Mapping[str, Any]
) -> str:
    if not len(points):
        return ""
    n_points = int((record.get("counts") or {}).get("map.points") or len(points))
    found = draw_coverage(points, times, n_points)
    if found is None:
        return ""
    density = (
        f"in squares of {found.cell:.2f} m; {found.median_density:,.0f} points per m² in the median"
    )
    visits = (
        f"of each square, ten seconds apart; of {found.area:,.0f} m² seen from above, "
        f"{100 * found.share_again:.0f} % were seen more than once"
    )
    figures = _figure(found.density, "Density", density) + _figure(found.visits, "Visits", visits)
    return f'<h2>Coverage</h2><div class="grid">{figures}</div>'


def _accuracy(
    points: NDArray[np.float64], revisits: Revisits | None, record: Mapping[str, Any]
) -> str:
    """Show how well the map agrees with itself: what is known without any reference."""
    title = "<h2>Accuracy, without a reference</h2>"
    expected = _expected(record.get("expected_accuracy"))
    if not len(points):
        return title + expected if expected else ""
    try:
        walls = wall_thickness(points)
    except ValueError:
        walls = None
    asked = bool((record.get("settings") or {}).get("loop_closure"))
    numbers = consistency_table(walls, revisits)
    closing = closing_table(record.get("loop_closure"), asked=asked)
    loops = revisits_table(revisits, None if walls is None else walls.median)
    return (
        f"{title}{expected}"
        f'<div class="grid"><div>{numbers}</div>'
        f'<div>{closing}</div><div class="wide"><h3>Loops</h3>{loops}</div></div>'
    )


def _expected(found: Mapping[str, Any] | None) -> str:
    return f"<p>{escape(ExpectedAccuracy(**found).sentence())}</p>" if found else ""


def _motion(trajectory: Trajectory, spin: Spin | None) -> str:
    t, p = trajectory.times, trajectory.positions
    position = line_plot([Series(n, t, p[:, i]) for i, n in enumerate("xyz")], "time, s", "position, m")  # fmt: skip
    steps = slice(None, None, 10)  # speeds over a tenth of a second, without the vibration
    speed = np.linalg.norm(np.diff(p[steps], axis=0), axis=1) / np.maximum(np.diff(t[steps]), 1e-9)
    figures = [
        _figure(position, "Position", "of the IMU in the map"),
        _figure(line_plot([Series("speed", t[steps][1:], speed)], "time, s", "speed, m/s"), "Speed"),
    ]  # fmt: skip
    if spin is not None:
        rate = line_plot([Series("rate", spin[0], np.degrees(spin[1]))], "time, s", "rate of turn, °/s", width=1140)  # fmt: skip
        note = "of the sensor head; where it stalls, the scanner sees one plane only"
        figures.append(_figure(rate, "Rate of turn", note, wide=True))
    return f'<h2>Motion</h2><div class="grid">{"".join(figures)}</div>'


def _windows(windows: Sequence[Mapping[str, Any]]) -> str:
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
        _figure(line_plot(matches, "time, s", "matches", bands=spans), "Matches", "of surfaces, per window; red where a direction of motion was not seen"),
        _figure(line_plot(share, "time, s", "inliers, %", top=100, bands=spans), "Inliers", "matches that agree"),
        _figure(line_plot(residual, "time, s", "residual, \N{GREEK SMALL LETTER SIGMA}", bands=spans), "Residual", "in units of the expected noise; 1 is as expected"),
        _figure(line_plot(surfels, "time, s", "surfels", bands=spans), "Surfels", "pieces of surface seen per window"),
    ]  # fmt: skip
    return f'<h2>Estimate, window by window</h2><div class="grid">{"".join(figures)}</div>'


def _calibrations(record: Mapping[str, Any]) -> str:
    runs = record.get("runs") or []
    if not runs:
        return calibration_table(record.get("calibration"))
    tables = [f"<h3>{escape(r['name'])}</h3>{calibration_table(r['calibration'])}" for r in runs]
    return "".join(tables)


_OF_FIXES = {
    "messages": "GNSS messages",
    "fixes": "GNSS fixes",
    "used": "GNSS fixes used",
    "rejected": "GNSS fixes left out",
    "rms_horizontal": "map from fixes, horizontal rms, m",
    "rms_vertical": "map from fixes, vertical rms, m",
}


def _georeference(found: Mapping[str, Any] | None) -> str:
    if not found:
        return ""
    facts: dict[str, Any] = {}
    if "epsg" in found:
        facts["coordinate system"] = f"{found['crs']} (EPSG:{found['epsg']})"
    facts |= {name: found[name] for name in ("heights", "mode") if name in found}
    if "heading" in found:
        facts["heading, ° north of east"] = np.degrees(found["heading"])
    if "std" in found:
        facts["its standard deviation, °"] = np.degrees(found["std"]["heading"])
        facts["standard deviation of the place, m"] = list(found["std"]["translation"])
        facts["meridian convergence, °"] = found["convergence_deg"]
        facts["point scale"] = found["point_scale"]
    fixes = found.get("fixes") or {}
    facts |= {
        _OF_FIXES.get(name, f"GNSS messages, {name.replace('_', ' ')}"): value
        for name, value in fixes.items()
        if name != "runs"
    }
    if "bent_by" in found:
        facts["trajectory bent by at most, m"] = found["bent_by"]
    cells = f"<div>{sections.mapping_table(('what', 'value'), facts)}</div>"
    if found.get("control_points"):
        rows = sections.residuals_table(found["control_points"])
        left = sections.mapping_table(("control points", "m"), found.get("residuals") or {})
        cells += f"<div><h3>Control points</h3>{rows}{left}</div>"
    if fixes.get("runs"):
        cells += f"<div><h3>GNSS fixes of the runs</h3>{sections.shares_table(fixes['runs'])}</div>"
    return f'<h2>Place on the Earth</h2><div class="grid">{cells}</div>'


def _record(record: Mapping[str, Any]) -> str:
    settings, versions = record.get("settings") or {}, record.get("versions") or {}
    blocks = [
        ("Counts", sections.mapping_table(("what", "number"), record.get("counts") or {})),
        ("Clocks", sections.mapping_table(("of", "value"), record.get("clocks") or {})),
        ("Time", sections.timings_table(record.get("timings") or {})),
        ("Settings", sections.mapping_table(("setting", "value"), settings)),
        ("Versions", sections.mapping_table(("of", "version"), versions)),
    ]
    cells = "".join(f"<div><h3>{name}</h3>{html}</div>" for name, html in blocks)
    inputs = sections.inputs_table(record.get("inputs") or [])
    return f'<h2>Record</h2><div class="grid">{cells}<div class="wide"><h3>Inputs</h3>{inputs}</div></div>'


def _figure(drawing: str, name: str, note: str = "", *, wide: bool = False) -> str:
    kind = ' class="wide"' if wide else ""
    caption = f"<b>{escape(name)}</b> {escape(note)}"
    return f"<figure{kind}>{drawing}<figcaption>{caption}</figcaption></figure>"


def _column(windows: Sequence[Mapping[str, Any]], name: str) -> NDArray[np.float64]:
    values = [window.get(name) for window in windows]
    return np.array([np.nan if value is None else float(value) for value in values])
