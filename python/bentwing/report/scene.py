# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map in three dimensions inside the report: turned, cut and measured, without any network."""

from __future__ import annotations

import json
from base64 import b64encode
from html import escape
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.map.sample import VALUES
from bentwing.report.colours import HEIGHT, TIME
from bentwing.report.frame import ShownFrame
from bentwing.report.stretches import degenerate
from bentwing.report.texts import ENGLISH
from bentwing.report.view.levels import FINEST, Level

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.report.texts import Texts

N_POINTS = 400_000
"""Points in the page, six bytes each and one for every colour but height."""
N_PATH = 20_000
_STEPS = 65535
_OVERLAP = 1.4  # voxels that a dot is wide
_LEVELS = 254  # of a colour; the one above is for what is not known
_UNKNOWN = 255
_LEAST_KNOWN = 0.01  # of the points, for a colour to be worth its button
_VIEWS = ("oblique", "top", "front", "side")
_CLICKED = ("points", "loop")
_SIDES = (("low", 0), ("high", 0), ("low", 1), ("high", 1), ("low", 2))
_SHOWN = {"sigma": 1e3, "intensity": 1.0, "incidence": 180.0 / np.pi}
"""Of `VALUES`, the factor to the unit that the legend has."""


def scene(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]] = (),
    *,
    ceiling: float | None = None,
    frame: ShownFrame | None = None,
    values: NDArray[np.float32] | None = None,
    texts: Texts = ENGLISH,
) -> str:
    """Return the view as HTML with its data and its script.

    Parameters
    ----------
    points : (N, 3) m, shown coordinates, at least one; thinned evenly in space if they are many
    times : (N,) s since the recording's start
    trajectory : of the IMU; may be empty
    windows : records of the estimate; where one is degenerate the path is red
    ceiling : m, at which the view is cut at first; default: nowhere
    frame : of points and trajectory; default: the map's own
    values : `map.sample.VALUES` of the points, (N, 3), NaN where they are not known
    texts : words of the language
    """
    level = Level(FINEST, N_POINTS)
    # The number of each point in the place of its time: so all that is known of it can follow.
    level.add(points, np.arange(len(points), dtype=np.float64))
    even = level.result  # one point per voxel: beams are dense where the sensor was
    kept = even.times.astype(np.intp)
    known = {} if values is None else dict(zip(VALUES, values[kept].T, strict=True))
    data = _data(
        even.points.astype(np.float64), times[kept], known, trajectory, windows, texts=texts
    )
    data["spacing"] = _OVERLAP * max(even.edge, data["spacing"] / _OVERLAP / 2)
    if ceiling is not None:
        data["cut"] = min(max(ceiling, data["low"][2]), data["high"][2])
    shown = frame or ShownFrame()
    data["shown"] = shown.origin.tolist()
    # from what is shown to the frame of the trajectory, in which control points are seen
    data["to_map"] = {
        "R": shown.R.T.tolist(),
        "place": shown.place.tolist(),
        "middle": shown.middle.tolist(),
    }
    script = files("bentwing.report").joinpath("scene.js").read_text(encoding="utf-8")
    choices = _choices([one["name"] for one in data["colours"]], texts)
    return (
        f'<figure id="scene" class="wide"><div class="stage">{_stage(texts)}</div>{choices}'
        f'<script type="application/json">{json.dumps(data)}</script>'
        f"<figcaption><b>{escape(texts.scene)}</b> {escape(texts.scene_note)} "
        f'<span class="without">{escape(texts.scene_off)}</span></figcaption></figure><script>{script}</script>'
    )


def _stage(texts: Texts) -> str:
    return (
        f'<canvas tabindex="0" role="img" aria-label="{escape(texts.scene_keys)}"></canvas>'
        '<svg data-part="measured"></svg>'
        '<div class="scale"><div data-part="bar"></div><span data-part="length"></span></div>'
        '<div class="legend"><div data-part="what"></div><div data-part="colours"></div>'
        '<span data-part="lowest"></span><span data-part="highest"></span></div>'
    )


def _choices(colours: Sequence[str], texts: Texts) -> str:
    words = texts.scene_words
    groups = []
    for name, choices in (
        ("colour", colours),
        ("view", _VIEWS),
        ("distance", ("measure",)),
        ("clicked", _CLICKED),
    ):
        buttons = "".join(
            f'<button type="button" value="{value}">{escape(words[value])}</button>'
            for value in choices
        )
        groups.append(f"<span>{escape(words[name])} {buttons}</span>")
    cut = _slider(words["cut"], "high", 2)
    sides = zip(texts.scene_sides, _SIDES, strict=True)
    box = "".join(_slider(name, *side) for name, side in sides)
    return (
        f'<div class="choices">{"".join(groups)}{cut}<output data-part="distance"></output></div>'
        f'<details class="box"><summary>{escape(words["box"])}</summary><div class="choices">{box}</div></details>'
    )


def _slider(name: str, side: str, axis: int) -> str:
    return f'<label>{escape(name)} <input type="range" data-side="{side}" data-axis="{axis}"><output></output></label>'


def _colours(
    heights: NDArray[np.float64],
    times: NDArray[np.float64],
    known: Mapping[str, NDArray[np.float32]],
    texts: Texts,
) -> list[dict[str, Any]]:
    """Return what the points can be coloured by: of all but height, the level of each point."""
    ends = np.percentile(heights, [1, 99]) if len(heights) else np.array([0.0, 1.0])
    span = np.array([times.min(), times.max()]) if len(times) else np.array([0.0, 1.0])
    height = {"name": "height", "range": ends.tolist(), "table": HEIGHT}
    time = {"name": "time", "range": span.tolist(), "table": TIME, "codes": _codes(times, span)}
    found = [height, time]
    for name, values in known.items():
        shown = values.astype(np.float64) * _SHOWN[name]
        of = shown[np.isfinite(shown)]
        if len(of) < max(_LEAST_KNOWN * len(shown), 1):
            continue
        ends = np.percentile(of, [1, 99])
        if ends[1] > ends[0]:
            one = {"name": name, "range": ends.tolist(), "table": HEIGHT}
            found.append({**one, "codes": _codes(shown, ends), "isPart": len(of) < len(shown)})
    return [{**one, "legend": texts.scene_legends[one["name"]]} for one in found]


def _codes(values: NDArray[np.float64], ends: NDArray[np.float64]) -> str:
    """Levels of values (N,) between two ends, as text."""
    share = np.clip((values - ends[0]) / max(ends[1] - ends[0], 1e-9), 0.0, 1.0)
    levels = np.where(np.isfinite(values), np.rint(_LEVELS * np.nan_to_num(share)), _UNKNOWN)
    return _text(levels.astype(np.uint8))


def _data(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    known: Mapping[str, NDArray[np.float32]],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]],
    *,
    texts: Texts,
) -> dict[str, Any]:
    # Far outliers would leave no steps for the rest.
    low, high = np.percentile(points, [0.05, 99.95], axis=0)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    points, times = points[inside], times[inside]
    known = {name: values[inside] for name, values in known.items()}
    chosen = slice(None, None, len(trajectory.times) // N_PATH + 1)
    path, path_times = trajectory.positions[chosen], trajectory.times[chosen]
    everything = np.concatenate([np.stack([low, high]), path])
    origin = everything.min(axis=0)
    step = float(max(np.ptp(everything, axis=0).max(), 1e-3)) / _STEPS
    radius = float(np.linalg.norm(high - low)) / 2
    return {
        "origin": origin.tolist(),
        "step": step,
        "centre": ((low + high) / 2).tolist(),
        "low": low.tolist(),
        "high": high.tolist(),
        "cut": float(high[2]),
        "words": texts.scene_words,
        "decimal": texts.decimal,
        "radius": max(radius, 0.5),
        # about what separates points that lie evenly on the surfaces of a box of this size
        "spacing": 2.0 * max(radius, 0.5) / max(len(points), 1) ** 0.5,
        "colours": _colours(points[:, 2], times, known, texts),
        "points": _text(np.rint((points - origin) / step).astype("<u2")),
        "path": _text(np.rint((path - origin) / step).astype("<u2")),
        "unsure": _text(degenerate(path_times, windows).astype(np.uint8)),
    }


def _text(values: NDArray[Any]) -> str:
    return b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
