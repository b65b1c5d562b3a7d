# SPDX-License-Identifier: MIT OR Apache-2.0
"""site.json: what came of each recording, and which of them are in one map."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from bentwing.base.regular_file import resolved

if TYPE_CHECKING:
    from pathlib import Path

    from bentwing.fleet.groups import Group
    from bentwing.fleet.site import Site
    from bentwing.fleet.task import Mapped


def site_record(site: Site) -> dict[str, Any]:
    """Return what the record of a site says, in plain JSON types; folders are relative to the site."""
    return {
        "recordings": [_recording(one, site.out) for one in site.recordings],
        "groups": None if site.groups is None else [_group(one, site.out) for one in site.groups],
        "failure": site.failure or None,
        "places": site.places,
    }


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
        "is_earlier": one.is_earlier,
    }


def _inside(folder: Path | None, out: Path) -> str | None:
    if folder is None:
        return None
    return os.path.relpath(resolved(folder), resolved(out)).replace(os.sep, "/")
