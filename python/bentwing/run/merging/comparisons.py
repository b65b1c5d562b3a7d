# SPDX-License-Identifier: MIT OR Apache-2.0
"""What comparing runs has found, kept in a folder: a further run is surveyed and compared alone.

A survey depends on one run and a comparison on two, whatever else is merged. Both are named by the
requests of their runs, so what is kept is neither stale nor of other runs.
"""

from __future__ import annotations

import os
import platform
from collections import Counter
from contextlib import contextmanager
from typing import TYPE_CHECKING

from bentwing.base.atomic import TEMPORARY_SUFFIX
from bentwing.base.run_record import RUN_FOLDER
from bentwing.closing.joining.matches import compare
from bentwing.closing.joining.stored import (
    read_comparison,
    read_survey,
    write_comparison,
    write_survey,
)
from bentwing.run.request import digest_of, request_in

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from bentwing.closing.joining.matches import Part
    from bentwing.closing.joining.survey import Survey
    from bentwing.closing.places import Candidate, Place
    from bentwing.run.merging.source import Source
    from bentwing.run.settings import MergeSettings

_SURVEY, _COMPARISON, _SUFFIX = "survey", "comparison", ".npz"


class Comparisons:
    """Surveys and comparisons in a folder, which is made if it does not exist.

    Attributes
    ----------
    done : how many `surveys` and `comparisons` were not there and were made
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._used: set[str] = set()
        self.done: Counter[str] = Counter(surveys=0, comparisons=0)

    def survey(
        self, source: Source, rate: float, settings: MergeSettings, made: Callable[[Source], Survey]
    ) -> Survey:
        """Return the survey of a run.

        Parameters
        ----------
        rate : most surfels a second
        made : makes it where there is none
        """
        asked = {"run": _request(source), "rate": rate, "settings": settings.loop_closure}
        path = self._path(_SURVEY, asked)
        survey = read_survey(path, source.name, source.estimate, source.payload)
        if survey is None:
            survey = made(source)
            with _named(path) as own:
                write_survey(own, survey)
            self.done["surveys"] += 1
        return survey

    def of(
        self, sources: Sequence[Source], parts: Mapping[Part, Sequence[Place]]
    ) -> Callable[[Part, Part], list[Candidate]]:
        """Return what compares two parts of these runs."""
        requests = [_request(source) for source in sources]

        def compared(a: Part, b: Part) -> list[Candidate]:
            # Places depend neither on the rate nor on settings of the merging.
            asked = {"parts": [(requests[part.run], part.segment) for part in (a, b)]}
            path = self._path(_COMPARISON, asked)
            found = read_comparison(path)
            if found is None:
                found = compare(parts[a], parts[b])
                with _named(path) as own:
                    write_comparison(own, found)
                self.done["comparisons"] += 1
            return found

        return compared

    def sentence(self) -> str:
        """Say how much there was to do."""
        n_surveys = sum(name.startswith(_SURVEY) for name in self._used)
        return (
            f"surveyed {self.done['surveys']} of {n_surveys} runs and compared "
            f"{self.done['comparisons']} of {len(self._used) - n_surveys} pairs; "
            "the others are as before"
        )

    def remove_others(self) -> None:
        """Remove what this merging had no use for, as of runs that were left out."""
        for path in self._folder.iterdir():
            # What is half-written is of a process that was killed.
            is_ours = path.suffix in (_SUFFIX, TEMPORARY_SUFFIX)
            if is_ours and path.name not in self._used:
                path.unlink(missing_ok=True)

    def _path(self, what: str, asked: Mapping[str, object]) -> Path:
        name = f"{what}-{digest_of(asked)}{_SUFFIX}"
        self._used.add(name)
        return self._folder / name


@contextmanager
def _named(path: Path) -> Iterator[Path]:
    """Yield a name of this process; a twin on another host may write the same file."""
    own = path.with_name(f".{path.stem}.{platform.node()}.{os.getpid()}{TEMPORARY_SUFFIX}")
    yield own
    own.replace(path)


def _request(source: Source) -> str:
    return request_in(RUN_FOLDER.read(source.folder) or {})
