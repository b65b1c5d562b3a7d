# SPDX-License-Identifier: MIT OR Apache-2.0
"""Control points from the CSV files that surveying programs write."""

from __future__ import annotations

import csv
import re
from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import InputError
from bentwing.base.regular_file import require_regular
from bentwing.closing.georeference.control_points import ControlPoint

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

RADIUS = 0.3
"""m, where a file names none: what is flat around a mark on a floor or a wall."""
_NAMES = {
    "id": ("id", "name", "point", "nr", "no", "number", "label", "mark", "punkt", "punktnummer"),
    "x": ("x", "e", "east", "easting", "rechtswert", "ostwert"),
    "y": ("y", "n", "north", "northing", "hochwert", "nordwert"),
    "z": ("z", "h", "u", "up", "height", "elev", "elevation", "alt", "altitude", "hoehe", "höhe"),
    "longitude": ("longitude", "lon", "long", "lng"),
    "latitude": ("latitude", "lat"),
    "radius": ("radius", "r"),
    "use": ("use", "type"),
    "map_x": ("map_x",), "map_y": ("map_y",), "map_z": ("map_z",),
}  # fmt: skip
_MOST_BYTES = 2**24  # a site has some hundred marks
_DELIMITERS = ";\t,"
_PLACES = {"degrees": ("longitude", "latitude", "z"), "metres": ("x", "y", "z")}
_PICKED = ("map_x", "map_y", "map_z")
_USES = ("control", "check")
_UNIT = re.compile(r"\s*[\[(].*[\])]\s*$")


@dataclass(frozen=True, slots=True)
class ControlPoints:
    """What a file lists.

    Attributes
    ----------
    points : the marks
    in_degrees : whether their positions are longitude, latitude and height
    columns : of each value, the name that the file has for it
    """

    points: tuple[ControlPoint, ...]
    in_degrees: bool
    columns: Mapping[str, str]


def read_control_points(path: Path) -> ControlPoints:
    """Read marks with name and position, and as far as there are: radius, use and place in the map.

    Columns may be separated by commas, semicolons or tabs, and have the names that surveying programs
    give them, such as `id`, `Punkt`, `Easting`, `Rechtswert`, `lat`; with semicolons or tabs, decimals may
    have commas.

    Raises
    ------
    InputError
        If a column is missing, a value is no number, a radius is not positive, or a name is twice.
    """
    require_regular(path, _MOST_BYTES)
    lines = _lines(path)
    delimiter = max(_DELIMITERS, key=lines[0].count) if lines else ","
    try:
        return _control_points(
            path, csv.DictReader(lines, delimiter=delimiter, skipinitialspace=True), delimiter
        )
    except csv.Error as error:
        msg = f"{path}: not readable as control points ({error})"
        raise InputError(msg) from error


def _control_points(path: Path, reader: csv.DictReader[str], delimiter: str) -> ControlPoints:
    columns = _columns(reader.fieldnames or [])
    places = _PLACES["degrees" if "longitude" in columns else "metres"]
    missing = [name for name in ("id", *places) if name not in columns]
    if missing:
        found = ", ".join(reader.fieldnames or []) or "nothing"
        msg = (
            f"{path}: has no column {', '.join(missing)}; its first line is {found!r}, and must name "
            "id, x, y, z (or longitude, latitude, z), and may name radius, use, map_x, map_y, map_z"
        )
        raise InputError(msg)
    points = tuple(_control_point(path, row, columns, places, delimiter) for row in reader)
    _require_names(path, [point.name for point in points])
    return ControlPoints(points, places == _PLACES["degrees"], columns)


def _lines(path: Path) -> list[str]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            return [line for line in file if line.strip() and not line.startswith("#")]
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror})"
        raise InputError(msg) from None
    except UnicodeDecodeError as error:
        msg = f"{path}: not readable as control points ({error})"
        raise InputError(msg) from error


def _columns(header: Sequence[str]) -> dict[str, str]:
    """Return the file's name for each value that it has."""
    plain = {_UNIT.sub("", name or "").strip().casefold(): name for name in reversed(header)}
    found = {}
    for name, others in _NAMES.items():
        known = [plain[other] for other in others if other in plain]
        if known:
            found[name] = known[0]
    return found


def _control_point(
    path: Path,
    row: Mapping[str, str],
    columns: Mapping[str, str],
    places: Sequence[str],
    delimiter: str,
) -> ControlPoint:
    def value(name: str) -> float:
        text = row[columns[name]]
        try:
            return float(text if delimiter == "," else text.replace(",", "."))
        except (AttributeError, TypeError, ValueError):
            return np.nan

    name = str(row[columns["id"]]).strip()
    use = ((row[columns["use"]] if "use" in columns else "") or "control").strip().lower()
    position = np.array([value(place) for place in places])
    radius = value("radius") if "radius" in columns else RADIUS
    is_picked = all(key in columns and (row[columns[key]] or "").strip() for key in _PICKED)
    picked = np.array([value(key) for key in _PICKED]) if is_picked else None
    is_known = np.isfinite(position).all() and (picked is None or np.isfinite(picked).all())
    if not (is_known and 0 < radius < 100) or use not in _USES:
        msg = (
            f"{path}: point {name!r} is {dict(row)}; expected numbers for {', '.join(places)}, a radius "
            "in metres, and as use control or check"
        )
        raise InputError(msg)
    return ControlPoint(name, position, radius, "check" if use == "check" else "control", picked)


def _require_names(path: Path, names: Sequence[str]) -> None:
    twice = sorted(name for name, n in Counter(names).items() if n > 1)
    if twice or not names:
        what = f"names {', '.join(twice[:3])} twice" if twice else "holds no point"
        msg = f"{path}: {what}; give every mark one line"
        raise InputError(msg)
