# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map in three dimensions inside the report: turned, cut and measured, without any network."""

from __future__ import annotations

import json
from base64 import b64encode
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.colours import HEIGHT, TIME
from bentwing.report.frame import ShownFrame
from bentwing.report.stretches import degenerate
from bentwing.report.view.levels import FINEST, Level

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

N_POINTS = 400_000
"""Points in the page, seven bytes each."""
N_PATH = 20_000
_STEPS = 65535
_OVERLAP = 1.4  # voxels that a dot is wide
_BUTTONS = {
    "Colour": {"height": "Height", "time": "Time"},
    "View": {"oblique": "Oblique", "top": "Top", "front": "Front", "side": "Side"},
    "Distance": {"measure": "Measure"},
    "Clicked": {"points": "Save points", "loop": "Save loop"},
}
_SIDES = (("x from", "low", 0), ("x to", "high", 0), ("y from", "low", 1), ("y to", "high", 1),
          ("height from", "low", 2))  # fmt: skip
_WORDS = {
    "first": "Click a point of the map.",
    "second": "Click another point.",
    "distance": "{whole} m apart; {level} m level, {up} m up.",
    "none": "Press Measure and click points of the map first.",
}


def scene(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]] = (),
    *,
    ceiling: float | None = None,
    frame: ShownFrame | None = None,
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
    """
    level = Level(FINEST, N_POINTS)
    level.add(points, times)
    even = level.result  # one point per voxel: beams are dense where the sensor was
    data = _data(even.points.astype(np.float64), even.times, trajectory, windows)
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
    return (
        f'<figure id="scene" class="wide"><div class="stage">{_STAGE}</div>{_choices()}'
        f'<script type="application/json">{json.dumps(data)}</script>'
        "<figcaption><b>In three dimensions</b> Without perspective, so that the scale bar is true everywhere. Drag to "
        "turn, right or shift drag to shift, two fingers to shift and zoom. The wheel zooms after a click, or with Ctrl. "
        "Keys: arrows turn, shift and arrows shift, + and \N{MINUS SIGN} zoom, Enter picks the point in the middle. What was "
        "clicked is saved as a file of control points, or the last two as a loop. The way of the sensor is dark, and red where a "
        'direction was not seen. <span class="without">This browser shows no WebGL; the pictures below say the '
        f"same.</span></figcaption></figure><script>{script}</script>"
    )


_STAGE = (
    '<canvas tabindex="0" role="img" aria-label="The map in three dimensions; arrow keys turn it"></canvas>'
    '<svg data-part="measured"></svg>'
    '<div class="scale"><div data-part="bar"></div><span data-part="length"></span></div>'
    '<div class="legend"><div data-part="colours"></div><span data-part="lowest"></span>'
    '<span data-part="highest"></span></div>'
)


def _choices() -> str:
    groups = []
    for name, choices in _BUTTONS.items():
        buttons = [
            f'<button type="button" value="{v}">{label}</button>' for v, label in choices.items()
        ]
        groups.append(f"<span>{name} {''.join(buttons)}</span>")
    cut = _slider("Cut at height", "high", 2)
    box = "".join(_slider(*side) for side in _SIDES)
    return (
        f'<div class="choices">{"".join(groups)}{cut}<output data-part="distance"></output></div>'
        f'<details class="box"><summary>Clip box</summary><div class="choices">{box}</div></details>'
    )


def _slider(name: str, side: str, axis: int) -> str:
    return f'<label>{name} <input type="range" data-side="{side}" data-axis="{axis}"><output></output></label>'


def _data(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    # Far outliers would leave no steps for the rest.
    low, high = np.percentile(points, [0.05, 99.95], axis=0)
    inside = ((points >= low) & (points <= high)).all(axis=1)
    points, times = points[inside], times[inside]
    chosen = slice(None, None, len(trajectory.times) // N_PATH + 1)
    path, path_times = trajectory.positions[chosen], trajectory.times[chosen]
    everything = np.concatenate([np.stack([low, high]), path])
    origin = everything.min(axis=0)
    step = float(max(np.ptp(everything, axis=0).max(), 1e-3)) / _STEPS
    radius = float(np.linalg.norm(high - low)) / 2
    first, last = (times.min(), times.max()) if len(times) else (0.0, 1.0)
    share = (times - first) / max(last - first, 1e-9)
    return {
        "origin": origin.tolist(),
        "step": step,
        "centre": ((low + high) / 2).tolist(),
        "low": low.tolist(),
        "high": high.tolist(),
        "cut": float(high[2]),
        "words": _WORDS,
        "radius": max(radius, 0.5),
        # about what separates points that lie evenly on the surfaces of a box of this size
        "spacing": 2.0 * max(radius, 0.5) / max(len(points), 1) ** 0.5,
        "heights": np.percentile(points[:, 2], [1, 99]).tolist() if len(points) else [0.0, 1.0],
        "seconds": [float(first), float(last)],
        "height_colours": HEIGHT,
        "time_colours": TIME,
        "points": _text(np.rint((points - origin) / step).astype("<u2")),
        "times": _text(np.rint(255 * share).astype(np.uint8)),
        "path": _text(np.rint((path - origin) / step).astype("<u2")),
        "unsure": _text(255 * degenerate(path_times, windows).astype(np.uint8)),
    }


def _text(values: NDArray[Any]) -> str:
    return b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
