# SPDX-License-Identifier: MIT OR Apache-2.0
"""What became of a recording with a fault: whether the map is right, and whether the user was told."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.evaluate.simulated import WorldError

Outcome = Literal[
    "right", "repaired", "repaired roughly", "right reason", "another reason", "silently wrong"
]
OUTCOMES: tuple[Outcome, ...] = (
    "right", "repaired", "repaired roughly", "right reason", "another reason", "silently wrong",
)  # fmt: skip
WRONG, FAR = 3.0, 0.05
"""A map is wrong that is so many times as far off as the good one, or so many m farther."""
REPAIRED = 2.0
"""A repaired map is at most so many times as far off as the good one."""
NO_MATTER = 0.005
"""m; a path that is less off is right, however exact the good one is."""
COVERED = 0.9
"""Least share of the flight that a map must have."""
FAMILIES = (
    r"mount|T_imu_lidar|T_imu_motor|T_motor_lidar", r"gyro|angular rate", r"acceler",
    r"clock|latency|stamp", r"\branges?\b", r"encoder|motor's axis|joint",
)  # fmt: skip
MOST_FAMILIES = 3
"""A sentence that suspects more than these names no cause."""


@dataclass(frozen=True, slots=True)
class Told:
    """What a run told its user.

    Attributes
    ----------
    state : `good`, `doubtful`, `failed`, or `refused` before anything was estimated
    sentences : why
    repairs : what was put right
    """

    state: str
    sentences: tuple[str, ...] = ()
    repairs: tuple[str, ...] = ()


def told(code: int, record: dict | None, said: str) -> Told:
    """What a run told, by its exit code, its record and what it printed.

    What it advises to check is no cause that it names.
    """
    found = record or {}
    verdict = found.get("verdict") or {}
    reasons = [reason["sentence"] for reason in verdict.get("reasons", [])]
    repairs = tuple(repair["sentence"] for repair in found.get("set_up") or [])
    if code == 0:
        return Told(verdict.get("state", "good"), tuple(reasons), repairs)
    state = "failed" if code == 4 else "refused"
    return Told(state, tuple(reasons or said.splitlines()), repairs)


def outcome(told: Told, error: WorldError | None, good: WorldError, cause: str) -> Outcome:
    """Say what became of a recording.

    Parameters
    ----------
    told : what the run said
    error, good : of this run, None where it left no map, and of the same flight without the fault
    cause : pattern of the words that name the fault
    """
    is_named = names(cause, (*told.sentences, *told.repairs))
    if told.state in ("failed", "refused"):
        return "right reason" if is_named else "another reason"
    if error is not None and not is_wrong(error, good):
        if not told.repairs:
            return "right"
        return "repaired" if is_as_good(error, good, REPAIRED) else "repaired roughly"
    if told.state == "doubtful":
        return "right reason" if is_named else "another reason"
    return "silently wrong"


def is_wrong(error: WorldError, good: WorldError) -> bool:
    """Whether path or map are much farther off than those of the good run."""
    far = any(ours > theirs + FAR for ours, theirs in _pairs(error, good))
    return far or not is_as_good(error, good, WRONG) or error.covered < COVERED * good.covered


def is_as_good(error: WorldError, good: WorldError, factor: float) -> bool:
    """Whether path and map are at most `factor` times as far off as those of the good run."""
    return all(ours <= factor * theirs for ours, theirs in _pairs(error, good))


def _pairs(error: WorldError, good: WorldError) -> list[tuple[float, float]]:
    return [(error.path, max(good.path, NO_MATTER)), (error.map, good.map)]


def names(cause: str, sentences: Sequence[str]) -> bool:
    """Whether a sentence names the cause, and does not just name all there are."""
    return any(
        re.search(cause, sentence, re.IGNORECASE | re.DOTALL) and not _suspects_all(sentence)
        for sentence in sentences
    )


def _suspects_all(sentence: str) -> bool:
    found = sum(bool(re.search(words, sentence, re.IGNORECASE)) for words in FAMILIES)
    return found > MOST_FAMILIES
