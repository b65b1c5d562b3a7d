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
from bentwing.closing.georeference.control_points import PICKED, ControlPoint, Standing

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.closing.georeference.control_points import Kind, Use

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
    "kind": ("kind", "target", "art"),
    **{name: (name,) for name in ("map_x", "map_y", "map_z", "sigma", "time", "until", "foot_x", "foot_y", "foot_z")},
}  # fmt: skip
_MOST_BYTES = 2**24  # a site has some hundred marks
_DELIMITERS = ";\t,"
_PLACES = {"degrees": ("longitude", "latitude", "z"), "metres": ("x", "y", "z")}
_PICKED = ("map_x", "map_y", "map_z")
_FOOT = ("foot_x", "foot_y", "foot_z")
_USES = ("control", "check")
_KINDS: dict[str, Kind] = {
    "": "surface",
    "surface": "surface",
    "sphere": "sphere",
    "kugel": "sphere",
}
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
            "id, x, y, z (or longitude, latitude, z), and may name radius, use, kind, map_x, map_y, map_z, sigma, "
            "time, until, foot_x, foot_y, foot_z"
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


@dataclass(frozen=True, slots=True)
class _Row:
    """A line of the file; what it leaves empty is None, and what is no number NaN."""

    texts: Mapping[str, str]
    columns: Mapping[str, str]
    has_commas: bool

    def text(self, name: str) -> str:
        return ((self.texts[self.columns[name]] if name in self.columns else "") or "").strip()

    def value(self, name: str) -> float | None:
        text = self.text(name)
        try:
            return float(text.replace(",", ".") if self.has_commas else text) if text else None
        except ValueError:
            return np.nan

    def point(self, names: Sequence[str]) -> NDArray[np.float64] | None:
        """Three values; None where one is left empty."""
        values = [self.value(name) for name in names]
        return None if None in values else np.array(values, np.float64)


def _control_point(
    path: Path,
    texts: Mapping[str, str],
    columns: Mapping[str, str],
    places: Sequence[str],
    delimiter: str,
) -> ControlPoint:
    row = _Row(texts, columns, delimiter != ",")
    name, use = row.text("id"), (row.text("use") or "control").lower()
    position, picked, standing = row.point(places), row.point(_PICKED), _standing(row)
    radius, sigma = (
        default if (given := row.value(of)) is None else given
        for of, default in (("radius", RADIUS), ("sigma", PICKED))
    )
    stood = None if standing is None else [standing.first, standing.last, *standing.foot]
    known = [one for one in ([radius, sigma], position, picked, stood) if one is not None]
    is_fit = np.isfinite(np.concatenate(known)).all() and 0 < radius < 100 and 0 < sigma < 100
    is_twice = picked is not None and standing is not None
    if position is None or not is_fit or is_twice or use not in _USES:
        msg = (
            f"{path}: point {name!r} is {dict(texts)}; expected numbers for {', '.join(places)}, radius and "
            "sigma in metres, map_x, map_y, map_z or the time at which the carrier stood on it, and as use "
            "control or check"
        )
        raise InputError(msg)
    used: Use = "check" if use == "check" else "control"
    kind = _KINDS.get(row.text("kind").lower())
    if kind is None or (kind == "sphere" and row.value("radius") is None):
        what = "a sphere without a radius" if kind else f"of the kind {row.text('kind')!r}"
        msg = (
            f"{path}: point {name!r} is {what}; the kind is surface or sphere, and a sphere has its radius "
            "in metres"
        )
        raise InputError(msg)
    return ControlPoint(name, position, radius, used, picked, sigma, standing, kind)


def _standing(row: _Row) -> Standing | None:
    time = row.value("time")
    if time is None:
        return None
    until, foot = row.value("until"), row.point(_FOOT)
    return Standing(time, time if until is None else until, np.zeros(3) if foot is None else foot)


def _require_names(path: Path, names: Sequence[str]) -> None:
    twice = sorted(name for name, n in Counter(names).items() if n > 1)
    if twice or not names:
        what = f"names {', '.join(twice[:3])} twice" if twice else "holds no point"
        msg = f"{path}: {what}; give every mark one line"
        raise InputError(msg)
