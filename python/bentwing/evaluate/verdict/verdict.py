# SPDX-License-Identifier: MIT OR Apache-2.0
"""What is said of a result: good, doubtful or failed, and why."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

from bentwing.evaluate.verdict.kinds import KINDS, LAST_CAUSE

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from bentwing.base.spans import Span
    from bentwing.evaluate.verdict.evidence import Evidence

State = Literal["good", "doubtful", "failed"]
_RANK = {"good": 0, "doubtful": 1, "failed": 2}
PLAIN = 2.0
"""Times what is doubtful."""


@dataclass(frozen=True, slots=True)
class Reason:
    """One thing that speaks against a result.

    Attributes
    ----------
    kind : of the evidence
    state : what it alone makes of the result
    sentence : what was found, with the figure
    advice : what to do
    value, bound : the measure, and what it stays below in a good result
    spans : when, s; empty where it is the whole time
    facts : what the sentence says beside the value, for other languages
    """

    kind: str
    state: State
    sentence: str
    advice: str
    value: float
    bound: float
    spans: tuple[Span, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Verdict:
    """Whether a result can be used.

    Attributes
    ----------
    state : `good`; `doubtful`: something is wrong with a part of it, or may be; `failed`: the map is wrong
    reasons : the gravest first; none for a good result
    measures : of all evidence by its kind, for whoever compares results
    """

    state: State
    reasons: tuple[Reason, ...]
    measures: Mapping[str, float]

    @property
    def headline(self) -> str:
        """What is said first."""
        return _HEADLINES[self.state]

    def sentence(self) -> str:
        """Return the state with the main reason, for the console."""
        if not self.reasons:
            return "good"
        main, *others = self.reasons
        more = f" (report.html has {len(others)} more)" if others else ""
        return f"{self.state}: {main.sentence}; {main.advice}{more}"

    def to_json(self) -> dict[str, Any]:
        """Return the verdict as run.json has it."""
        return {
            "state": self.state,
            "headline": self.headline,
            "reasons": [
                {
                    "kind": reason.kind,
                    "state": reason.state,
                    "sentence": reason.sentence,
                    "advice": reason.advice,
                    "value": reason.value,
                    "bound": reason.bound,
                    "spans": [list(span) for span in reason.spans],
                    "facts": dict(reason.facts),
                }
                for reason in self.reasons
            ],
            "measures": dict(self.measures),
        }

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> Verdict:
        """Read the verdict in a run.json."""
        reasons = [
            Reason(
                one["kind"],
                one["state"],
                one["sentence"],
                one["advice"],
                float("inf") if one["value"] is None else one["value"],
                one["bound"],
                tuple((first, last) for first, last in one["spans"]),
                dict(one.get("facts") or {}),
            )
            for one in described["reasons"]
        ]
        return cls(described["state"], tuple(reasons), dict(described.get("measures") or {}))


_HEADLINES = {
    "good": "Good: all that was checked agrees",
    "doubtful": "Doubtful: check this map before using it",
    "failed": "Failed: this map is wrong, do not use it",
}


def verdict_of(evidence: Iterable[Evidence], judged: Iterable[Reason] = ()) -> Verdict:
    """Weigh evidence: the gravest piece decides.

    Parameters
    ----------
    judged : reasons that are known already
    """
    found = list(evidence)
    reasons = sorted([*judged, *filter(None, map(_reason, found))], key=_order)
    state: State = max((r.state for r in reasons), key=_RANK.__getitem__, default="good")
    return Verdict(state, tuple(reasons), {one.kind: one.value for one in found})


def _reason(evidence: Evidence) -> Reason | None:
    kind, value = KINDS[evidence.kind], evidence.value
    if value <= kind.doubtful:
        return None
    return Reason(
        evidence.kind,
        "doubtful" if value <= kind.failed else "failed",  # what is no number has failed
        kind.sentence(evidence),
        kind.advice,
        value,
        kind.doubtful,
        evidence.spans,
        evidence.facts,
    )


def _order(reason: Reason) -> tuple[int, int]:
    """Order reasons: the gravest first, a cause before its effects.

    What is plainly wrong with the samples is the cause of a failure even if it is none by itself.
    """
    rank = KINDS[reason.kind].rank
    is_cause = rank <= LAST_CAUSE and not reason.value <= PLAIN * reason.bound
    return -_RANK["failed" if is_cause else reason.state], rank
