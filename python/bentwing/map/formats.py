# SPDX-License-Identifier: MIT OR Apache-2.0
"""The formats of maps: what writes and what reads each, imported when first used."""

from __future__ import annotations

from importlib import import_module
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

from bentwing.base.errors import UsageError

MapFormat: TypeAlias = Literal["laz", "copc.laz", "las", "ply", "pcd", "e57"]
MAP_FORMATS: tuple[MapFormat, ...] = get_args(MapFormat)
MAP_SUFFIXES = tuple(f".{name}" for name in MAP_FORMATS)


class Format(NamedTuple):
    """A subclass of `MapWriter`, a reader of points, and the optional package that both need."""

    writer: str
    reader: str
    package: str | None = None


FORMATS: dict[MapFormat, Format] = {
    "laz": Format("write_las.LazWriter", "read_las.las_points"),
    "copc.laz": Format("write_copc.CopcWriter", "read_las.las_points"),
    "las": Format("write_las.LasWriter", "read_las.las_points"),
    "ply": Format("write_ply.PlyWriter", "read_rows.ply_rows"),
    "pcd": Format("write_pcd.PcdWriter", "read_rows.pcd_rows"),
    "e57": Format("write_e57.E57Writer", "read_e57.e57_scans", package="pye57"),
}


def load(home: str) -> Any:  # noqa: ANN401 - a class or a function
    """Import a writer or a reader of `FORMATS`."""
    module, name = home.split(".")
    return getattr(import_module(f"bentwing.map.{module}"), name)


def require_format(map_format: str) -> MapFormat:
    """Refuse a format that cannot be written, before the hours of work that come first.

    Raises
    ------
    UsageError
        If the format is unknown or needs a package that is not installed.
    """
    for known, entry in FORMATS.items():
        if known == map_format:
            if entry.package is not None:
                require_package(known)
            return known
    msg = f"map format {map_format!r} is not known; choose one of {', '.join(MAP_FORMATS)}"
    raise UsageError(msg)


def require_room(map_format: str, *, normals: bool, attributes: bool) -> None:
    """Refuse a format that cannot hold what is asked for.

    Raises
    ------
    UsageError
    """
    asked = [
        name for name, is_asked in (("normals", normals), ("attributes", attributes)) if is_asked
    ]
    if map_format == "e57" and asked:
        msg = (
            f"E57 maps hold coordinates and intensities only, no {' or '.join(asked)}; write "
            "LAZ, COPC, PLY or PCD"
        )
        raise UsageError(msg)


def require_package(map_format: MapFormat) -> Any:  # noqa: ANN401 - the packages have no types
    """Import the optional package of a format.

    Raises
    ------
    UsageError
        If it is not installed.
    """
    package = FORMATS[map_format].package
    try:
        return import_module(package or "")
    except ImportError:
        msg = (
            f"{map_format.upper()} maps need the package {package}, which is not installed; "
            f"run `pip install bentwing[{map_format}]`"
        )
        raise UsageError(msg) from None
