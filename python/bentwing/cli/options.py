# SPDX-License-Identifier: MIT OR Apache-2.0
"""The options that several commands have: each with one name, one short form and one sentence."""

from collections.abc import Callable, Iterable
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from bentwing.base.new_file import require_folder, require_new, require_writable
from bentwing.base.threads import MOST_THREADS
from bentwing.closing.georeference.names import GeoreferenceMode
from bentwing.map.formats import MapFormat
from bentwing.odometry.names import EstimatorName
from bentwing.recording.gnss_files.names import TimeScale
from bentwing.recording.ready import payload_path

# The groups of a help page, in its order.
INPUT = "Input"
RESULT = "Result"
ESTIMATION = "Estimation"
MAP = "Map"
EARTH = "Coordinates"
RUNNING = "Running"
GROUPS = (INPUT, RESULT, ESTIMATION, MAP, EARTH, RUNNING)


def option(group: str, *names: str, **details: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return an option in a group of the help page."""
    return typer.Option(*names, rich_help_panel=group, **details)


def enumeration(title: str, names: Iterable[str]) -> Any:  # noqa: ANN401 - a type
    """Return the type of a repeatable choice: typer takes lists of enumerations, but not of literals."""
    return Enum(title, {name: name for name in names}, type=str)


def _checked(check: Callable[[Path], None]) -> Callable[[Path | None], Path | None]:
    """Return what looks at a place to write to before anything else is done."""

    def checked(path: Path | None) -> Path | None:
        if path is not None:
            check(path)
        return path

    return checked


def folder(*names: str, **details: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return an option that names a folder to write into."""
    return option(RESULT, *names, metavar="FOLDER", callback=_checked(require_folder), **details)


def file(*names: str, **details: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return an option that names a file to write."""
    return option(RESULT, *names, metavar="FILE", callback=_checked(require_writable), **details)


def out(*aliases: str, **details: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return the option that names the folder of the results."""
    return folder("--out", "-o", *aliases, help="Write into this folder.", **details)


def payload(**details: Any) -> Any:  # noqa: ANN401 - typer's own
    """Return the option that names the description of the sensor head."""
    help_line = (
        "Description of the sensor head: payload.yaml, or dataset:NAME of `bentwing payload list`."
    )
    return option(
        INPUT, "--payload", "-p", metavar="FILE", help=help_line, parser=payload_path, **details
    )


def out_file(help_line: str) -> Any:  # noqa: ANN401 - typer's own
    """Return the option that names the file to write, which must not exist."""
    return file("--out", "-o", help=help_line)


def names(text: str | None) -> tuple[str, ...] | None:
    """Return names with commas between them."""
    return None if text is None else tuple(word.strip() for word in text.split(",") if word.strip())


def cleaning(*, keep_mixed: bool, keep_moving: bool) -> dict[str, bool]:
    """Return what the map keeps, where that differs from the settings."""
    kept = {"mixed_pixels": keep_mixed, "moving": keep_moving}
    return {name: False for name, is_kept in kept.items() if is_kept}


_RECORDING = typer.Argument(
    metavar="RECORDING",
    help="ROS 1 .bag, ROS 2 bag folder, .db3, .mcap, .pcap or .lvx2; several parts of one recording "
    "one after the other.",
    rich_help_panel=INPUT,
)
Recording = Annotated[list[Path], _RECORDING]
SomeRecording = Annotated[list[Path] | None, _RECORDING]
Payload = Annotated[Path | None, payload()]
Start = Annotated[
    float | None, option(INPUT, metavar="SECONDS", min=0, help="Time to skip at the start.")
]
Duration = Annotated[
    float | None, option(INPUT, metavar="SECONDS", min=0, help="Length of the part to use.")
]

Run = Annotated[
    Path,
    typer.Argument(
        metavar="RUN",
        help="Folder that `bentwing map`, `merge` or `localize` has written.",
        rich_help_panel=INPUT,
    ),
]

Out = Annotated[Path, out()]
Json = Annotated[bool, option(RESULT, "--json", help="Print one JSON object instead.")]

Estimator = Annotated[
    EstimatorName | None,
    option(
        ESTIMATION,
        show_default="continuous",
        help="Method of the odometry: kalman for 3D lidars, faster; ndt for 3D lidars without an IMU.",
    ),
]
Settings = Annotated[
    Path | None,
    option(
        ESTIMATION,
        metavar="FILE",
        help="Settings as YAML, all or some of those that --print-settings prints.",
    ),
]
Set = Annotated[
    list[str],
    option(
        ESTIMATION,
        "--set",
        metavar="NAME=VALUE",
        show_default=False,
        help="Change one setting, such as window=4 of the estimator; repeatable.",
    ),
]

Format = Annotated[
    MapFormat | None,
    option(MAP, "--map-format", show_default="laz", help="Format of the map."),
]
Spacing = Annotated[
    float | None,
    option(
        MAP,
        "--map-spacing",
        metavar="METRES",
        min=0,
        show_default="0",
        help="Keep one point per voxel of this edge; 0 keeps all.",
    ),
]
KeepMoving = Annotated[
    bool,
    option(
        MAP,
        "--keep-moving",
        help="Keep points that beams went through at other times or in other runs.",
    ),
]
NoRefine = Annotated[
    bool,
    option(
        MAP,
        "--no-refine",
        help="Leave points where they were measured, rather than on the surface that they measured "
        "together.",
    ),
]
Normals = Annotated[
    bool,
    option(MAP, "--normals", help="Give points the normal of their surface, towards the lidar."),
]
Attributes = Annotated[
    str | None,
    option(
        MAP,
        metavar="NAME,NAME...",
        help="Carry these further fields of the lidar's points, which `bentwing info` lists.",
    ),
]
KeepMixed = Annotated[bool, option(MAP, "--keep-mixed", help="Keep returns between two surfaces.")]

Georeference = Annotated[
    GeoreferenceMode | None,
    option(
        EARTH,
        "--georeference",
        show_default="rigid",
        help="Use of GNSS fixes and control points; constraints may bend the map.",
    ),
]
Epsg = Annotated[
    int | None,
    option(
        EARTH,
        metavar="CODE",
        min=1,
        show_default="UTM zone",
        help="Projected system of the map.",
    ),
]
Gnss = Annotated[
    Path | None,
    option(
        EARTH,
        "--gnss",
        metavar="FILE",
        show_default="topic in payload.yaml",
        help="GNSS fixes from a file: solution of RTKLIB (.pos), or NMEA 0183 with GGA.",
    ),
]
GnssTime = Annotated[
    TimeScale | None,
    option(
        EARTH,
        "--gnss-time",
        show_default="what the file says",
        help="Time scale of that file; GPS is ahead of UTC by the leap seconds.",
    ),
]
ControlPoints = Annotated[
    Path | None,
    option(
        EARTH,
        metavar="FILE",
        help="CSV of surveyed points: id, x, y, z, and radius, use, map_x, map_y, map_z where known.",
    ),
]

Project = Annotated[
    Path | None,
    option(
        RESULT,
        metavar="FILE",
        help="YAML with name, site, client, operator and more of the project, for the report.",
    ),
]
WritePayload = Annotated[
    Path | None,
    option(
        RESULT,
        "--write-payload",
        metavar="FILE",
        callback=_checked(require_new),
        help="Write the sensor head as it was found, as payload.yaml; the file must not exist.",
    ),
]
TrustPayload = Annotated[
    bool,
    option(
        INPUT,
        "--trust-payload",
        help="Take the head as payload.yaml says, even where the recording shows another set-up.",
    ),
]
Force = Annotated[
    bool,
    option(INPUT, "--force", help="Map a recording that `bentwing info` calls unfit."),
]

Loops = Annotated[
    Path | None,
    option(
        ESTIMATION,
        metavar="FILE",
        help="YAML of pairs of times at which the same place was seen, or was not.",
    ),
]

Threads = Annotated[
    int | None,
    option(
        RUNNING,
        "--threads",
        "-j",
        metavar="N",
        min=1,
        max=MOST_THREADS,
        show_default="all cores",
        help="Number of threads; the result does not depend on it.",
    ),
]
Resume = Annotated[
    bool, option(RUNNING, "--resume", help="Continue the run in FOLDER that was killed.")
]
Quiet = Annotated[bool, option(RUNNING, "--quiet", "-q", help="Print nothing but errors.")]
