# SPDX-License-Identifier: MIT OR Apache-2.0
"""The folder of many runs, and how a result made elsewhere comes into it: by one renaming.

A result is made in a folder that belongs to its request and to one host. So nothing half done has the
name of a result, a process that was killed leaves no lock that another host would believe, and on the
same host it goes on from its checkpoint.
"""

from __future__ import annotations

import platform
import re
import shutil
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import TEMPORARY_SUFFIX
from bentwing.base.errors import UsageError
from bentwing.base.result_folder import RecordedFolder
from bentwing.base.run_record import RUN_FOLDER

if TYPE_CHECKING:
    from pathlib import Path

SITE_RECORD = "site.json"
SITE_FOLDER = RecordedFolder(SITE_RECORD, "bentwing site", "site")
PAGE = "index.html"
RECORDINGS, GROUPS, COMPARISONS = "recordings", "groups", "comparisons"
_SHOWN = 16  # digits of a request in a name
_OTHER = "{place}: holds something else than a run; move it away, or choose another folder"
# What tells nothing of the recording: times, and what is drawn with them.
_OF_THE_RUN = frozenset({"report.html"})


def staging_of(place: Path, request: str) -> Path:
    """Return where a result is made before it has its name."""
    host = re.sub(r"[^\w-]", "-", platform.node())
    return place.with_name(f".{place.name}.{request[:_SHOWN]}.{host}{TEMPORARY_SUFFIX}")


def require_run_or_nothing(place: Path) -> None:
    """Refuse a place that holds something else, which a result would have to replace.

    Raises
    ------
    UsageError
    """
    if place.exists() and RUN_FOLDER.read(place) is None:
        raise UsageError(_OTHER.format(place=place))


def publish(staging: Path, place: Path) -> None:
    """Give a result its name, in place of an earlier one.

    Where the same result is there already, as of a task that ran twice, that stays.

    Raises
    ------
    UsageError
        If the place holds something else.
    RuntimeError
        If the same request had other bytes before, which must not be.
    """
    made, earlier = RUN_FOLDER.read(staging) or {}, RUN_FOLDER.read(place) or {}
    if made.get("complete") and earlier.get("complete") and _is_same(made, earlier):
        RUN_FOLDER.remove(staging)
    else:
        require_run_or_nothing(place)
        RUN_FOLDER.remove(place)
        if place.exists():  # beside the run there is something else
            raise UsageError(_OTHER.format(place=place))
        staging.replace(place)
    clear_staging(place)


def clear_staging(place: Path) -> None:
    """Remove what was made for a place and is not needed any more, of whatever request and host."""
    for left in place.parent.iterdir():
        if _name_in(left.name) == place.name:
            shutil.rmtree(left, ignore_errors=True)


def _name_in(staging: str) -> str | None:
    """Return the name of the result that is made in a folder of this name, None if it is none."""
    words = staging.removesuffix(TEMPORARY_SUFFIX).rsplit(".", 2)
    return words[0][1:] if staging.endswith(TEMPORARY_SUFFIX) and len(words) == 3 else None


def _is_same(made: dict[str, Any], earlier: dict[str, Any]) -> bool:
    """Whether two records are of the same request; raises RuntimeError if their results differ."""
    if not made.get("request") or made["request"] != earlier.get("request"):
        return False
    ours, theirs = (
        {n: h.get("sha256") for n, h in (r.get("hashes") or {}).items() if n not in _OF_THE_RUN}
        for r in (made, earlier)
    )
    if ours != theirs:
        names = ", ".join(sorted(n for n in {*ours, *theirs} if ours.get(n) != theirs.get(n)))
        msg = f"two runs of the same request differ in {names}: this is a bug in bentwing"
        raise RuntimeError(msg)
    return True
