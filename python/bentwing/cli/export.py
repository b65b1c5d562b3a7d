# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing export`: a finished run in another form."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from bentwing.base.errors import UsageError
from bentwing.cli import options
from bentwing.cli.options import EARTH, MAP, RESULT, names, option
from bentwing.map.formats import MapFormat
from bentwing.run.export.names import TrajectoryFormat

if TYPE_CHECKING:
    from bentwing.map.crop import Crop

CROP = "Part of the map"

EXAMPLES = (
    "bentwing export run -o site.copc.laz --spacing 0.02",
    "bentwing export run -o hall.e57 --box 0,0,-1,30,20,8",
    "bentwing export run -o plot.laz --polygon plot.geojson --heights 0,2.5",
    "bentwing export run -o normals.ply --normals",
    "bentwing export run -o near.ply --within 15 --times 30,200",
    "bentwing export run -o tiles.laz --tiles 50 --epsg 25832",
    "bentwing export run -o path.kml",
    "bentwing export run -o run.mcap",
)


def command(
    run: options.Run,
    *,
    out: Annotated[
        Path,
        options.out_file(
            "Write this; its suffix says the format of a map (.copc.laz .laz .las .ply .pcd .e57) "
            "or a trajectory (.txt .kitti .csv .kml .geojson); .mcap has both, for Foxglove and RViz."
        ),
    ],
    map_format: Annotated[
        MapFormat | None,
        option(RESULT, "--map-format", show_default="by the suffix", help="Format of the map."),
    ] = None,
    trajectory_format: Annotated[
        TrajectoryFormat | None,
        option(
            RESULT,
            "--trajectory-format",
            show_default="by the suffix",
            help="Write the trajectory in this format.",
        ),
    ] = None,
    tiles: Annotated[
        int | None,
        option(
            RESULT,
            metavar="METRES",
            min=1,
            help="Write a folder of square tiles of this edge, with an index.",
        ),
    ] = None,
    box: Annotated[
        str | None,
        option(CROP, metavar="X0,Y0,Z0,X1,Y1,Z1", help="Keep what is in this box, m."),
    ] = None,
    polygon: Annotated[
        Path | None,
        option(CROP, metavar="FILE", help="Keep what is inside, seen from above: GeoJSON or DXF."),
    ] = None,
    heights: Annotated[
        str | None, option(CROP, metavar="LOW,HIGH", help="Keep these heights, m.")
    ] = None,
    times: Annotated[
        str | None,
        option(CROP, metavar="FIRST,LAST", help="Keep what was measured then, s since the start."),
    ] = None,
    within: Annotated[
        float | None,
        option(CROP, metavar="METRES", help="Keep what is so near to the path of the IMU."),
    ] = None,
    spacing: Annotated[
        float | None,
        option(
            MAP,
            metavar="METRES",
            min=0,
            show_default="that of the map",
            help="Keep one point per voxel of this edge; 0 keeps all.",
        ),
    ] = None,
    keep_moving: Annotated[
        bool | None,
        option(
            MAP,
            "--keep-moving/--drop-moving",
            show_default="as in the map",
            help="Whether to keep points that beams went through at other times.",
        ),
    ] = None,
    keep_mixed: Annotated[
        bool | None,
        option(
            MAP,
            "--keep-mixed/--drop-mixed",
            show_default="as in the map",
            help="Whether to keep returns between two surfaces.",
        ),
    ] = None,
    refine: Annotated[
        bool | None,
        option(
            MAP,
            "--refine/--no-refine",
            show_default="as in the map",
            help="Whether to move points to the surface that they measured together.",
        ),
    ] = None,
    attributes: Annotated[
        str | None,
        option(
            MAP,
            metavar="NAME,NAME...",
            show_default="those of the map",
            help="Carry these further fields of the lidar's points.",
        ),
    ] = None,
    normals: Annotated[
        bool | None,
        option(
            MAP,
            "--normals/--no-normals",
            show_default="as in the map",
            help="Whether points have the normal of their surface, towards the lidar.",
        ),
    ] = None,
    epsg: Annotated[
        int | None,
        option(
            EARTH,
            metavar="CODE",
            min=1,
            show_default="that of the map",
            help="Projected system of the coordinates.",
        ),
    ] = None,
    local: Annotated[
        bool, option(EARTH, "--local", help="Write coordinates in the frame of the trajectory.")
    ] = False,
    threads: options.Threads = None,
    quiet: options.Quiet = False,
) -> None:
    """Write the map or the trajectory of a finished run in another form, without estimating again.

    Points come from the map in the run folder; where that does not have what is wished, as a finer spacing
    than its own, the recording is read once more. Crops are in the coordinates of the export.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.run.export.export import export
    from bentwing.run.export.points import ExportOptions

    options = ExportOptions(
        spacing=spacing,
        crop=_crop(box, heights, times, within),
        polygon=polygon,
        keep_moving=keep_moving,
        keep_mixed=keep_mixed,
        refine=refine,
        normals=normals,
        attributes=names(attributes),
        epsg=epsg,
        local=local,
    )
    written = export(
        run,
        out,
        options,
        tiles=tiles,
        map_format=map_format,
        trajectory_format=trajectory_format,
        threads=threads,
        progress=create_progress(quiet=quiet),
    )
    if not quiet:
        typer.echo(written.sentence())


def _crop(box: str | None, heights: str | None, times: str | None, within: float | None) -> "Crop":
    from bentwing.map.crop import Crop

    try:
        return Crop(
            box=_numbers("--box", box, 6),
            heights=_numbers("--heights", heights, 2),
            times=_numbers("--times", times, 2),
            within=within,
        )
    except ValueError as error:
        raise UsageError(str(error)) from None


def _numbers(name: str, text: str | None, n: int) -> Any:  # noqa: ANN401 - as many as are asked for
    if text is None:
        return None
    try:
        values = [float(word) for word in text.split(",")]
    except ValueError:
        values = []
    if len(values) != n:
        msg = f"{name}: expected {n} numbers with commas between them, got {text!r}"
        raise UsageError(msg)
    return values
