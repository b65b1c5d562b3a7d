# SPDX-License-Identifier: MIT OR Apache-2.0
"""The contents of a run as rerun shows them."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_writable
from bentwing.base.progress import Progress
from bentwing.report.colours import HEIGHT, colour
from bentwing.report.stretches import degenerate
from bentwing.report.view.contents import MOST_SURFELS, Contents, read_contents

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.report.view.levels import LevelPoints

TIMELINE = "recording"
MOST_POINTS = 3_000_000
_SLICE = 1.0  # s of points that appear together
_NORMAL = 0.15  # m, length of a drawn normal
_PATH_COLOUR, _UNSURE_COLOUR = (240, 240, 240), (230, 75, 50)
_CURVES = {
    "matches": ("n_matches", "n_fixed_matches", "n_surfels"),
    "agreement": ("inlier_share", "residual_rms"),
}


def view_run(
    folder: Path,
    *,
    save: Path | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> None:
    """Show a run in the rerun viewer, or write what it would show to a file.

    Parameters
    ----------
    folder : that `bentwing map` has written
    save : a .rrd file to write instead of opening the viewer
    max_points : of the finest level of the map; larger maps are thinned evenly in space
    progress : what to tell the user meanwhile

    Raises
    ------
    UsageError
        If rerun is not installed, the folder is no run, or the file cannot be written.
    InputError
        If a file in it cannot be read.
    """
    try:
        import rerun
    except ImportError as error:
        msg = "the viewer is not installed: pip install 'bentwing[view]'"
        raise UsageError(msg) from error
    if save is not None:
        require_writable(save)
    with (progress or Progress()).stage("read the map", None, "points") as shown:
        contents = read_contents(folder, max_points, shown)
    stream = rerun.RecordingStream("bentwing")
    if save is None:
        stream.spawn(default_blueprint=_blueprint(contents))
    else:
        stream.save(save, default_blueprint=_blueprint(contents))
    log_contents(stream, contents)
    stream.flush()
    stream.disconnect()  # the file gets its end


def log_contents(stream: Any, contents: Contents) -> None:  # noqa: ANN401 - rerun is optional
    """Log a run to a `rerun.RecordingStream`."""
    import rerun

    stream.log("map", rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    span = _heights(contents.levels[-1])
    for number, level in enumerate(contents.levels):
        _log_level(stream, f"map/{level_name(number)}", level, span)
    _log_surfels(stream, contents)
    _log_path(stream, contents)
    for name, fields in _CURVES.items():
        for field in fields:
            values = [(float(w["time"]), w.get(field)) for w in contents.windows]
            known = [(time, float(value)) for time, value in values if value is not None]
            stream.send_columns(
                f"windows/{name}/{field}",
                indexes=[rerun.TimeColumn(TIMELINE, duration=[time for time, _ in known])],
                columns=rerun.Scalars.columns(scalars=[value for _, value in known]),
            )


def level_name(number: int) -> str:
    """Name of a level of detail, the finest first."""
    return ("fine", "medium", "coarse")[number]


def _log_level(stream: Any, path: str, level: LevelPoints, span: tuple[float, float]) -> None:  # noqa: ANN401
    import rerun

    order = np.argsort(level.times, kind="stable")
    points, times = level.points[order], level.times[order]
    shade = (points[:, 2].astype(np.float64) - span[0]) / max(span[1] - span[0], 1e-9)
    colours = colour(shade, HEIGHT).astype(np.uint8)
    slices = np.floor(times / _SLICE).astype(np.int64)
    for k, rows in enumerate(_runs(slices)):
        # A slice stays once it has come, so that the map grows with the time of the viewer.
        stream.set_time(TIMELINE, duration=float(times[rows.start]))
        cloud = rerun.Points3D(points[rows], colors=colours[rows], radii=level.edge / 2)
        stream.log(f"{path}/{k}", cloud)


def _runs(values: NDArray[np.int64]) -> list[slice]:
    """Return the stretches of equal values."""
    if not len(values):
        return []
    edges = [0, *(np.flatnonzero(np.diff(values)) + 1).tolist(), len(values)]
    return [slice(a, b) for a, b in pairwise(edges)]


def _log_surfels(stream: Any, contents: Contents) -> None:  # noqa: ANN401
    import rerun

    chosen = slice(None, None, len(contents.surfels) // MOST_SURFELS + 1)
    centres, normals = contents.surfels.centres[chosen], contents.surfels.normals[chosen]
    # Direction is what a normal tells: x red, y green, z blue.
    colours = (255 * np.abs(normals)).astype(np.uint8)
    arrows = rerun.Arrows3D(origins=centres, vectors=_NORMAL * normals, colors=colours)
    stream.log("map/surfels", arrows, static=True)


def _log_path(stream: Any, contents: Contents) -> None:  # noqa: ANN401
    import rerun

    times, positions = contents.trajectory.times, contents.trajectory.positions
    unsure = degenerate(times, contents.windows)
    stretches = _runs(unsure.astype(np.int64))
    # Each stretch begins with the last pose before it, so that the line has no gaps.
    lines = [positions[max(rows.start - 1, 0) : rows.stop] for rows in stretches]
    colours = [_UNSURE_COLOUR if unsure[rows.start] else _PATH_COLOUR for rows in stretches]
    stream.log("map/path", rerun.LineStrips3D(lines, colors=colours, radii=0.02), static=True)
    poses = slice(None, None, 5)
    quats = contents.trajectory.quats_xyzw[poses]
    stream.send_columns(
        "map/imu",
        indexes=[rerun.TimeColumn(TIMELINE, duration=times[poses])],
        columns=rerun.Transform3D.columns(translation=positions[poses], quaternion=quats),
    )
    stream.log("map/imu", rerun.TransformAxes3D(0.5), static=True)


def _heights(level: LevelPoints) -> tuple[float, float]:
    if not len(level.points):
        return 0.0, 1.0
    low, high = np.percentile(level.points[:, 2], [1, 99])
    return float(low), float(high)


def _blueprint(contents: Contents) -> Any:  # noqa: ANN401
    """Show the fine map and the path; coarser levels and surfels wait to be switched on."""
    import rerun.blueprint as rrb

    hidden = [f"map/{level_name(n)}" for n in range(1, len(contents.levels))] + ["map/surfels"]
    overrides: dict[Any, Any] = {path: rrb.EntityBehavior(visible=False) for path in hidden}
    curves = [rrb.TimeSeriesView(origin=f"windows/{name}", name=name) for name in _CURVES]
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Spatial3DView(origin="map", name="map", overrides=overrides),
            rrb.Vertical(*curves),
            column_shares=[3, 1],
        ),
        collapse_panels=True,
    )
