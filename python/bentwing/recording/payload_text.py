# SPDX-License-Identifier: MIT OR Apache-2.0
"""A sensor head as the text of a payload.yaml: what differs from the defaults, with its units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import yaml

from bentwing.base.units import Unit
from bentwing.recording.sections.calibration import STD_UNITS, CalibrationRecord
from bentwing.recording.sections.section import Section

if TYPE_CHECKING:
    from collections.abc import Iterator

INDENT = "  "
COMMENTS = 42  # column of the units


def payload_text(payload: Section) -> str:
    """Return the text, which reads as the same value; an empty mapping where all are defaults."""
    return "\n".join(_lines(payload, "")) + "\n" if payload.differing() else "{}\n"


def _lines(section: Section, indent: str) -> Iterator[str]:
    for name, value in section.differing().items():
        if isinstance(value, Section):
            inner = list(_lines(value, indent + INDENT))
            yield from [f"{indent}{name}:", *inner] if inner else [f"{indent}{name}: {{}}"]
        elif isinstance(value, tuple) and value and isinstance(value[0], Section):
            yield f"{indent}{name}:"
            for one in value:
                ((key, inner_value),) = one.model_dump(mode="json").items()
                yield f"{indent}{INDENT}- {key}: {_flow(inner_value)}"
        elif isinstance(section, CalibrationRecord) and isinstance(value, dict):
            yield f"{indent}{name}:"
            for key, one in value.items():
                yield _entry(indent + INDENT, key, one, STD_UNITS.get(key))
        elif isinstance(section, CalibrationRecord) and name == "not_observable":
            yield f"{indent}{name}:"
            yield from (f"{indent}{INDENT}- {_flow(sentence)}" for sentence in value)
        else:
            units = [
                m.symbol for m in type(section).model_fields[name].metadata if isinstance(m, Unit)
            ]
            yield _entry(indent, name, value, units[0] if units else None)


def _entry(indent: str, name: str, value: Any, unit: str | None) -> str:  # noqa: ANN401 - any leaf
    text = f"{indent}{_flow(name)}: {_flow(value)}"
    return text if unit is None else f"{text.ljust(COMMENTS)}  # {unit}"


def _flow(value: Any) -> str:  # noqa: ANN401 - any leaf
    """Return a value on one line."""
    plain = list(value) if isinstance(value, tuple) else value
    text = yaml.safe_dump(
        [_listed(plain)],
        default_flow_style=True,
        width=float("inf"),
        allow_unicode=str(value).isprintable(),
        sort_keys=False,
    )
    return text.strip()[1:-1]


def _listed(value: Any) -> Any:  # noqa: ANN401 - any leaf
    return [_listed(one) for one in value] if isinstance(value, (list, tuple)) else value
