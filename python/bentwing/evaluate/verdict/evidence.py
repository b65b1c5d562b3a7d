# SPDX-License-Identifier: MIT OR Apache-2.0
"""One measure of a result; the larger its value, the worse."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.base.spans import Span


@dataclass(frozen=True, slots=True)
class Evidence:
    """A measure, to be compared with the bounds of its kind.

    Attributes
    ----------
    kind : one of `KINDS`
    value : the measure
    spans : when it is beyond what is doubtful, s, if that is a part of the time
    facts : what the sentence says beside it
    """

    kind: str
    value: float
    spans: tuple[Span, ...] = ()
    facts: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> Evidence:
        """Read what was written as JSON; a value that is not finite is written as null."""
        value = described["value"]
        return cls(
            described["kind"],
            float("inf") if value is None else float(value),
            tuple((first, last) for first, last in described["spans"]),
            dict(described["facts"]),
        )
