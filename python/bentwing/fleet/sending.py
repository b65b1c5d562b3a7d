# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs and merged maps on their way between a store and a folder of the same shape.

A run is in the store when its record is, which is written last and removed first.
"""

from __future__ import annotations

import json
from pathlib import PurePosixPath
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_bytes
from bentwing.base.folder_lock import LOCK
from bentwing.base.run_record import RECORD, RUN_FOLDER
from bentwing.fleet.folder import COMPARISONS, GROUPS
from bentwing.fleet.groups import ANSWER
from bentwing.fleet.stored import renamed

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from bentwing.fleet.store import Store, StoredFile

    Found = Mapping[str, StoredFile]

# Of a run, what a merging does not read: the map and its pictures.
_SHOWN = (".html", ".png")
_MAP = "map"
_MOST_OF_RECORD = 2**28  # bytes


def fetch_records(store: Store, found: Found, site: Path) -> None:
    """Fetch the records of all complete runs and maps, and what was said of the groups."""
    for name in found:
        if PurePosixPath(name).name == RECORD:
            _fetch_record(store, found, str(PurePosixPath(name).parent), site)
    answer = f"{GROUPS}/{ANSWER}"
    if answer in found:
        store.fetch(answer, found[answer], site / answer)


def fetch_for_merging(store: Store, found: Found, runs: Iterable[str], site: Path) -> None:
    """Fetch what a merging reads of these runs, and what an earlier one has left."""
    fetch_records(store, {n: f for n, f in found.items() if n.startswith(f"{GROUPS}/")}, site)
    wanted = {COMPARISONS, *runs}
    for name, stored in found.items():
        path = PurePosixPath(name)
        is_shown = path.suffix in _SHOWN or path.name.startswith(f"{_MAP}.")
        if str(path.parent) in wanted and not is_shown:
            store.fetch(name, stored, site / name)


def send_run(store: Store, site: Path, run: str) -> None:
    """Send a run in the place of an earlier one.

    Parameters
    ----------
    run : its folder in the site
    """
    folder, earlier = site / run, store.files(run)
    store.remove({f"{run}/{RECORD}"} & {*earlier})
    # Where the run was made is no place that anybody else could look at.
    RUN_FOLDER.write(folder, renamed(RUN_FOLDER.read(folder), {str(site): store.url}))
    files = [file for file in sorted(folder.rglob("*")) if file.is_file() and file.name != LOCK]
    names = [file.relative_to(site).as_posix() for file in files]
    for name in sorted(names, key=lambda name: name == f"{run}/{RECORD}"):
        store.put(site / name, name)
    store.remove(sorted({*earlier} - {*names}))


def send_groups(store: Store, found: Found, site: Path, answer: Mapping[str, Any]) -> None:
    """Send merged maps and what was compared, and remove what does not belong to the site any more."""
    named = {f"{GROUPS}/{one['folder']}": one for one in answer["groups"] if one["folder"]}
    for run, one in named.items():
        if not one["is_earlier"]:
            send_run(store, site, run)
    kept = {f"{COMPARISONS}/{file.name}" for file in (site / COMPARISONS).glob("*")}
    for name in sorted(kept - {*found}):
        store.put(site / name, name)
    store.put(site / GROUPS / ANSWER, f"{GROUPS}/{ANSWER}")
    old = [n for n in found if n.startswith(f"{GROUPS}/") and n != f"{GROUPS}/{ANSWER}"]
    gone = [n for n in old if "/".join(n.split("/")[:2]) not in named]
    gone += [n for n in found if n.startswith(f"{COMPARISONS}/") and n not in kept]
    store.remove(sorted(gone, key=lambda name: PurePosixPath(name).name != RECORD))


def _fetch_record(store: Store, found: Found, run: str, site: Path) -> None:
    """Fetch the record of a run if the files that it lists are there."""
    content = store.read(f"{run}/{RECORD}", _MOST_OF_RECORD)
    try:
        hashes = json.loads(content)["hashes"]
        is_whole = all(found[f"{run}/{n}"].size == one["bytes"] for n, one in hashes.items())
    except (ValueError, LookupError, AttributeError, TypeError):
        is_whole = False
    if is_whole:
        (site / run).mkdir(parents=True, exist_ok=True)
        write_bytes(site / run / RECORD, content)
