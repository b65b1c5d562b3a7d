# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run in the viewer of Open3D, or as a picture that it draws without a screen."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.atomic import atomic_path
from bentwing.base.errors import UsageError
from bentwing.base.new_file import require_new
from bentwing.base.progress import Progress
from bentwing.products.open3d_clouds import to_open3d
from bentwing.products.open3d_package import require_open3d
from bentwing.report.colours import HEIGHT, colour
from bentwing.report.view.contents import read_contents
from bentwing.report.view.show import MOST_POINTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.report.view.contents import Contents

_WIDTH, _HEIGHT = 1600, 1000  # px
_ANGLE = 60.0  # degrees, of the view from top to bottom
_FROM = np.array([-0.4, -0.55, 0.5])  # of the middle, in sizes of the map
_POINT = 2.0  # px
_PATH_COLOUR = (0.9, 0.3, 0.2)


def view_in_open3d(
    run: Path | str,
    *,
    save: Path | None = None,
    max_points: int = MOST_POINTS,
    progress: Progress | None = None,
) -> None:
    """Show a run in Open3D's viewer: its map by height, and its path.

    Parameters
    ----------
    run : folder that `map`, `merge` or `localize` has written
    save : .png to draw instead of opening the viewer; needs no screen
    max_points : of the map; larger ones are thinned evenly in space
    progress : what to tell the user meanwhile

    Raises
    ------
    UsageError
        If Open3D cannot be loaded or cannot draw, or the folder is no run.
    InputError
        If a file in it cannot be read.
    """
    if save is not None:
        require_new(save, (".png",))
    o3d = require_open3d()
    with (progress or Progress()).stage("read the map", None, "points") as shown:
        contents = read_contents(Path(run), max_points, shown)
    geometries = {"map": _map(o3d, contents), "path": _path(o3d, contents)}
    if save is None:
        named = [{"name": name, "geometry": one} for name, one in geometries.items()]
        o3d.visualization.draw(named, title=f"bentwing {run}", point_size=int(_POINT))
        return
    points = contents.levels[0].points
    with atomic_path(save) as temporary:
        image = _drawn(o3d, geometries, points if len(points) else contents.trajectory.positions)
        # by the suffix it knows what to write
        drawn = temporary.with_suffix(".png")
        o3d.io.write_image(str(drawn), image)
        drawn.replace(temporary)


def _map(o3d: Any, contents: Contents) -> Any:  # noqa: ANN401 - Open3D has no types
    points = contents.levels[0].points.astype(np.float32)
    cloud = o3d.t.geometry.PointCloud(o3d.core.Tensor(points))
    heights = points[:, 2]
    low, high = np.percentile(heights, [1, 99]) if len(heights) else (0.0, 1.0)
    shares = (heights.astype(np.float64) - low) / max(float(high - low), 1e-9)
    cloud.point["colors"] = o3d.core.Tensor((colour(shares, HEIGHT) / 255).astype(np.float32))
    return cloud


def _path(o3d: Any, contents: Contents) -> Any:  # noqa: ANN401
    lines = to_open3d(contents.trajectory)
    lines.point["positions"] = lines.point["positions"].to(o3d.core.float32)  # all it can draw
    n = len(lines.line.indices)
    lines.line["colors"] = o3d.core.Tensor(np.tile(np.array(_PATH_COLOUR, np.float32), (n, 1)))
    return lines


def _drawn(o3d: Any, geometries: dict[str, Any], points: NDArray[Any]) -> Any:  # noqa: ANN401
    rendering = o3d.visualization.rendering
    try:
        renderer = rendering.OffscreenRenderer(_WIDTH, _HEIGHT)
    except RuntimeError as error:
        msg = (
            f"Open3D cannot draw here ({error}); install a driver that draws without a screen, on Debian "
            "and Ubuntu `apt install libvulkan1 mesa-vulkan-drivers libegl1`"
        )
        raise UsageError(msg) from None
    for name, shader in (("map", "defaultUnlit"), ("path", "unlitLine")):
        material = rendering.MaterialRecord()
        material.shader, material.point_size, material.line_width = shader, _POINT, _POINT
        renderer.scene.add_geometry(name, geometries[name], material)
    renderer.scene.set_background([1.0, 1.0, 1.0, 1.0])
    renderer.scene.view.set_post_processing(False)
    low, high = np.percentile(points, [1, 99], axis=0).astype(np.float64)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    renderer.setup_camera(_ANGLE, middle, middle + size * _FROM, [0.0, 0.0, 1.0])
    return renderer.render_to_image()
