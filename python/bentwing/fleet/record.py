# SPDX-License-Identifier: MIT OR Apache-2.0
"""What came of many recordings, as a value and as site.json says it."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.regular_file import resolved
from bentwing.base.run_record import understood
from bentwing.fleet.task import Mapped

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.fleet.groups import Group


@dataclass(frozen=True, slots=True)
class Site:
    """Many recordings, mapped.

    Attributes
    ----------
    out : the folder
    recordings : what came of each, in the order given
    groups : runs in one frame each, the merged ones first; None where nothing was merged
    failure : why there are no merged maps, empty where there are
    places : what the merging compared, as in run.json
    merging : settings of the merging that were given
    url : of a site in a store; then `out` is '.', and all folders are relative to this
    """

    out: Path
    recordings: list[Mapped]
    groups: list[Group] | None = None
    failure: str = ""
    places: Mapping[str, Any] | None = None
    merging: Mapping[str, Any] | None = None
    url: str | None = None

    def place(self, path: Path) -> str:
        """Return where something of the site is, as users name it."""
        return str(path) if self.url is None else f"{self.url}/{path.as_posix()}"

    def in_store(self, url: str) -> Site:
        """Return the site whose copy this is."""

        def moved(folder: Path) -> Path:
            return folder.relative_to(self.out)

        mapped = [
            one if one.folder is None else replace(one, folder=moved(one.folder))
            for one in self.recordings
        ]
        groups = self.groups and [replace(one, folder=moved(one.folder)) for one in self.groups]
        return replace(self, out=Path(), recordings=mapped, groups=groups, url=url)

    @property
    def is_complete(self) -> bool:
        """Whether every recording has a map that is not wrong, and the merging did not fail."""
        maps = [one.state for one in self.groups or []]
        return (
            all(one.is_usable for one in self.recordings)
            and not self.failure
            and "failed" not in maps
        )

    def to_json(self) -> dict[str, Any]:
        """Return what site.json says; folders are relative to the site."""
        groups = self.groups
        return {
            "recordings": [_recording(one, self.out) for one in self.recordings],
            "groups": None if groups is None else [_group(one, self.out) for one in groups],
            "failure": self.failure or None,
            "places": self.places,
            "merging": self.merging,
        }


def usable_in(record: Mapping[str, Any], out: Path) -> list[Mapped]:
    """Return the recordings of a site whose runs can be used, from its record."""
    with understood(out):
        found = [
            Mapped(one["name"], one["state"], folder=out / one["folder"])
            for one in record["recordings"]
            if one["folder"] is not None
        ]
    return [one for one in found if one.is_usable]


def _recording(one: Mapped, out: Path) -> dict[str, Any]:
    return {
        "name": one.name,
        "state": one.state,
        "reason": one.reason or None,
        "folder": _inside(one.folder, out),
        "request": one.request or None,
        "seconds": one.seconds,
        "points": one.points,
        "is_earlier": one.is_earlier,
    }


def _group(one: Group, out: Path) -> dict[str, Any]:
    return {
        "runs": list(one.runs),
        "folder": _inside(one.folder, out),
        "state": one.state,
        "reason": one.reason or None,
        "n_links": one.n_links,
        "joins": list(one.joins),
        "is_earlier": one.is_earlier,
    }


def _inside(folder: Path | None, out: Path) -> str | None:
    if folder is None:
        return None
    return os.path.relpath(resolved(folder), resolved(out)).replace(os.sep, "/")
