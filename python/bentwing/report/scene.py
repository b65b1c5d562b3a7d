# SPDX-License-Identifier: MIT OR Apache-2.0
"""The map in three dimensions inside the report: turned with the mouse, without any network."""

from __future__ import annotations

import json
from base64 import b64encode
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.report.colours import HEIGHT, TIME
from bentwing.report.stretches import degenerate

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory

N_POINTS = 300_000
"""Points in the page, seven bytes each."""
N_PATH = 20_000
_STEPS = 65535
_BUTTONS = {
    "Colour": {"height": "Height", "time": "Time"},
    "View": {"oblique": "Oblique", "top": "Top", "side": "Side"},
}


def scene(
    points: NDArray[np.float64],
    times: NDArray[np.float64],
    trajectory: Trajectory,
    windows: Sequence[Mapping[str, Any]] = (),
) -> str:
    """Return the view as HTML with its data and its script.

    Parameters
    ----------
    points : (N, 3) m, map frame, at least one; every k-th is shown if they are many
    times : (N,) s since the recording's start
    trajectory : of the IMU; may be empty
    windows : records of the estimate; where one is degenerate the path is red
    """
    chosen = slice(None, None, len(points) // N_POINTS + 1)
    data = json.dumps(_data(points[chosen], times[chosen], trajectory, windows))
    script = files("bentwing.report").joinpath("scene.js").read_text(encoding="utf-8")
    return (
        '<figure id="scene" class="wide"><canvas></canvas>'
        f'<div class="choices">{_buttons()}</div>'
        f'<script type="application/json">{data}</script>'
        "<figcaption><b>In three dimensions</b> Drag to turn, wheel to zoom, right or shift drag to "
        "shift. The path of the sensor is dark, and red where a direction was not seen. "
        '<span class="without">This browser shows no WebGL; the pictures below say the same.</span>'
        f"</figcaption></figure><script>{script}</script>"
    )


def _buttons() -> str:
    groups = []
    for name, choices in _BUTTONS.items():
        buttons = [f'<button value="{v}">{label}</button>' for v, label in choices.items()]
        groups.append(f"<span>{name} {''.join(buttons)}</span>")
    return "".join(groups)


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
        "radius": max(radius, 0.5),
        # about what separates points that lie evenly on the surfaces of a box of this size
        "spacing": 2.0 * max(radius, 0.5) / max(len(points), 1) ** 0.5,
        "heights": np.percentile(points[:, 2], [1, 99]).tolist() if len(points) else [0.0, 1.0],
        "height_colours": HEIGHT,
        "time_colours": TIME,
        "points": _text(np.rint((points - origin) / step).astype("<u2")),
        "times": _text(np.rint(255 * share).astype(np.uint8)),
        "path": _text(np.rint((path - origin) / step).astype("<u2")),
        "unsure": _text(255 * degenerate(path_times, windows).astype(np.uint8)),
    }


def _text(values: NDArray[Any]) -> str:
    return b64encode(np.ascontiguousarray(values).tobytes()).decode("ascii")
