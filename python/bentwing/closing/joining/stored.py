# SPDX-License-Identifier: MIT OR Apache-2.0
"""Surveys, and what comparing places has found, as files: read back bit for bit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing import _core
from bentwing.base.packed import pack, unpack
from bentwing.base.sealed import DAMAGE, read_sealed, write_sealed
from bentwing.closing.global_registration import Recorded, Stretches
from bentwing.closing.global_registration.stretches import segments_of
from bentwing.closing.joining.survey import Survey
from bentwing.closing.places import Agreement, Alignment, Candidate, FreeSpace, Place
from bentwing.closing.places.cloud import Surfels
from bentwing.closing.places.keypoints import Keypoints
from bentwing.closing.places.things import Things
from bentwing.recording import ImuBatch

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from bentwing.base.estimate import Estimate
    from bentwing.recording import Payload

_OF_SURVEYS = (_core.Surfels, FreeSpace, ImuBatch, Keypoints, Place, Surfels)
_OF_COMPARISONS = (Agreement, Alignment, Candidate, Things)


def write_survey(path: Path, survey: Survey) -> None:
    """Write a survey without the estimate and the payload, which are the run's."""
    recorded = survey.recorded
    surfels = [segment.surfels for segment in recorded.segments]
    _write(path, (surfels, recorded.inertial, survey.places, survey.segments))


def read_survey(path: Path, name: str, estimate: Estimate, payload: Payload) -> Survey | None:
    """Read the survey of a run; return None where there is none that can be used."""
    try:
        surfels, inertial, places, numbers = _read(path, _OF_SURVEYS)
        segments = [
            Stretches(trajectory, seen)
            for trajectory, seen in zip(segments_of(estimate), surfels, strict=True)
        ]
    except (OSError, *DAMAGE):
        return None
    return Survey(name, Recorded(estimate, payload, segments, inertial), places, numbers)


def write_comparison(path: Path, candidates: Sequence[Candidate]) -> None:
    """Write what comparing the places of two parts has found."""
    _write(path, list(candidates))


def read_comparison(path: Path) -> list[Candidate] | None:
    """Read what comparing has found; return None where there is nothing that can be used."""
    try:
        found: list[Candidate] = _read(path, _OF_COMPARISONS)
    except (OSError, *DAMAGE):
        return None
    return found


def _write(path: Path, value: object) -> None:
    packed, arrays = pack(value)
    write_sealed(path, {"value": packed}, arrays)


def _read(path: Path, classes: Sequence[type]) -> Any:  # noqa: ANN401 - what was written
    arrays, described = read_sealed(path)
    return unpack(described["value"], arrays, classes)
