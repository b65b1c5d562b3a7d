# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which of many runs belong together, and the map of each group that is not there yet."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.run_record import RUN_FOLDER, read_record
from bentwing.run.merging import (
    Comparisons,
    budget_of,
    describe_map,
    find_groups,
    make_map,
    open_sources,
    settled,
)
from bentwing.run.request import deciding, digest_of, request_in
from bentwing.run.run import verdict_in

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from bentwing.base.progress import Progress
    from bentwing.closing.joining.placing import Placed
    from bentwing.evaluate.verdict import Verdict
    from bentwing.run.merging.maps import Ingredients
    from bentwing.run.merging.source import Source
    from bentwing.run.settings import MergeSettings


def merge_groups(
    runs: Mapping[str, str],
    out: Path,
    settings: MergeSettings,
    made: Mapping[str, str],
    *,
    kept: Path,
    recordings: Mapping[str, Sequence[Path]],
    progress: Progress,
) -> dict[str, Any]:
    """Find the groups of runs, and make the maps of those that are not there yet.

    Parameters
    ----------
    runs : run folders by name
    out : folder in which each group that is made gets a folder
    made : folders of complete groups by their requests
    kept : folder of what comparing runs has found, so that it is found once
    recordings : of the runs that do not find them where they had them, by their names

    Returns
    -------
    `groups`, each with its runs, its folder (None for a run that belongs to no other), its verdict and
    whether it was there, `places`: what was compared, and `said`: how much of that was done now.

    Raises
    ------
    UsageError, InputError
    """
    folders = {name: Path(run) for name, run in runs.items()}
    moved = {folders[name]: list(paths) for name, paths in recordings.items()}
    opened = open_sources(list(folders.values()), moved)
    sources = [replace(source, name=name) for source, name in zip(opened, runs, strict=True)]
    settings = settled(settings, sources)
    comparisons = Comparisons(kept)
    groups, found = find_groups(sources, settings, progress, lambda _: nullcontext(), comparisons)
    rooms = _Rooms(out, made, found, settings, budget_of(sources, settings).rate)
    answer = {
        "groups": rooms.answers(groups),
        "places": found.record,
        "said": comparisons.sentence(),
    }
    comparisons.remove_others()
    return answer


@dataclass(slots=True)
class _Rooms:
    """Where the maps of groups are or come to be.

    Attributes
    ----------
    rate : most surfels a second, which depends on how long all runs are together
    """

    out: Path
    made: Mapping[str, str]
    found: Ingredients
    settings: MergeSettings
    rate: float

    def answers(self, groups: list[Placed]) -> list[dict[str, Any]]:
        """Say what each group is, and make the maps that are not there yet."""
        asked = [self._asked(group) for group in groups]
        kept = {request for _, _, request in asked if request in self.made}
        free = _numbers({Path(self.made[request]).name for request in kept})
        found = []
        for group, (members, described, request) in zip(groups, asked, strict=True):
            said = {name: described[name] for name in ("runs", "n_links", "joins")}
            if len(members) == 1:
                folder, verdict = None, members[0].verdict
            elif request in kept:
                folder = Path(self.made[request]).name
                verdict = verdict_in(read_record(Path(self.made[request])))
            else:
                folder = next(free)
                verdict = self._make(group, members, {**described, "folder": folder}, request)
            found.append(
                {
                    **said,
                    "folder": folder,
                    "verdict": verdict.to_json(),
                    "is_earlier": request in kept,
                }
            )
        return found

    def _asked(self, group: Placed) -> tuple[list[Source], dict[str, Any], str]:
        """Return the runs of a group, what it consists of, and its request."""
        described = describe_map("", group, self.found)
        members = [source for source in self.found.sources if source.name in described["runs"]]
        return members, described, self._request(members, described)

    def _make(
        self, group: Placed, members: list[Source], described: dict[str, Any], request: str
    ) -> Verdict:
        own = self.settings.model_copy(update={"runs": tuple(one.folder for one in members)})
        out = self.out / described["folder"]
        return make_map(out, group, self.found, described, own.to_json(), request=request).verdict

    def _request(self, members: list[Source], described: dict[str, Any]) -> str:
        """Return the SHA-256 of all that the bytes of a group's map depend on."""
        runs = [(one.name, request_in(RUN_FOLDER.read(one.folder) or {})) for one in members]
        asked = {"settings": deciding(self.settings), "rate": self.rate, "runs": runs}
        return digest_of({**asked, "graph": described["graph"]})


def _numbers(taken: set[str]) -> Iterator[str]:
    """Yield the numbers from one on that no group has."""
    return (str(n) for n in count(1) if str(n) not in taken)
