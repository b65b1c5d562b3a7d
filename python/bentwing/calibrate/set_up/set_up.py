# SPDX-License-Identifier: MIT OR Apache-2.0
"""What was found of a set-up, as values."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from bentwing.base.plain import plain
from bentwing.recording import Payload

if TYPE_CHECKING:
    from collections.abc import Mapping

Kind = Literal["mount", "axes", "units", "latency", "mirrored", "encoder", "ranges", "clock"]


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is other than the payload says.

    Attributes
    ----------
    kind : what it is about
    sentence : what was found, with the figure that shows it
    line : for payload.yaml
    """

    kind: Kind
    sentence: str
    line: str

    def to_json(self) -> dict[str, Any]:
        """Return the finding as run.json has it."""
        return {"kind": self.kind, "sentence": self.sentence, "line": self.line}


@dataclass(frozen=True, slots=True)
class SetUp:
    """How a head is set up, as its recording shows it.

    Attributes
    ----------
    payload : the description with what was found
    findings : in what it differs from the one given; none where that one holds
    doubt : why it is not certain, with what to do; None where it is
    is_defect : whether the doubt names what is wrong with a sensor
    """

    payload: Payload
    findings: tuple[Finding, ...] = ()
    doubt: str | None = None
    is_defect: bool = False

    def to_json(self) -> dict[str, Any]:
        """Return the set-up in plain JSON types."""
        return {
            "payload": plain(self.payload.model_dump()),
            "findings": [finding.to_json() for finding in self.findings],
        }

    @classmethod
    def from_json(cls, described: Mapping[str, Any]) -> SetUp:
        """Read what `to_json` wrote of a set-up that is certain."""
        payload = Payload.model_validate(described["payload"])
        return cls(payload, tuple(Finding(**finding) for finding in described["findings"]))
