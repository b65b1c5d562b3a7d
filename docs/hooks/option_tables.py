# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fills `<!-- options: map -->` and `<!-- settings: kalman -->` with tables while the pages are built.

The tables come from the command line and the settings models themselves. `<!-- settings:
CleanSettings.moving -->` is a table of one setting, `<!-- faults: encoder -->` one of the faults whose
names begin so.
"""

from __future__ import annotations

import re
from enum import Enum
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from pydantic import BaseModel

from bentwing.base.units import Unit
from bentwing.cli.command import rank
from bentwing.cli.commands import load
from bentwing.closing import MatchSettings, PlaceSettings
from bentwing.odometry import EstimatorName
from bentwing.run.settings import RunSettings
from bentwing.simulate.faults import FAULTS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic.fields import FieldInfo

MARKER = re.compile(r"^<!-- (options|settings|faults): ([\w.]+) -->$", re.MULTILINE)
_ESTIMATORS = get_args(EstimatorName)
_BOUNDS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


def on_page_markdown(markdown: str, **_: Any) -> str:  # noqa: ANN401 - mkdocs passes its own types
    """Replace the markers of one page."""
    return MARKER.sub(lambda marker: table(marker[1], marker[2]), markdown)


def table(kind: str, name: str) -> str:
    """Return the table for a marker.

    Raises
    ------
    KeyError
        If there is no command, estimator, settings model, setting or fault of that name.
    """
    if kind == "options":
        parameters = sorted(load(name).params, key=lambda one: rank(one.rich_help_panel))
        return _markdown(("option", "default", "meaning"), map(option_row, parameters))
    if kind == "faults":
        return _markdown(("fault", "what is wrong"), fault_rows(name))
    name, _, only = name.partition(".")
    model, prefix = settings_models()[name]
    fields = {only: model.model_fields[only]} if only else model.model_fields
    headings = ("setting", "default", "unit", "range", "meaning")
    return _markdown(headings, (setting_row(prefix + n, f) for n, f in fields.items()))


def option_row(parameter: Any) -> tuple[str, ...]:  # noqa: ANN401 - typer hides its own click
    """Return name, default and meaning of an option or argument."""
    choices = [str(_plain(choice)) for choice in parameter.type_descriptor.choices or ()]
    value = parameter.metavar or ("NAME" if choices else "")
    if parameter.param_type_name == "argument":
        names = [value]
    else:
        *names, last = sorted(parameter.opts, key=len)
        names.append(f"{last} {value}".strip())
    meaning = parameter.help
    if not all(choice in meaning for choice in choices):
        meaning += f" One of {', '.join(f'`{choice}`' for choice in choices)}."
    return ", ".join(f"`{name}`" for name in names), _default_of(parameter), meaning


def fault_rows(family: str) -> list[tuple[str, ...]]:
    """Return name and sentence of the faults whose names begin with a word."""
    found = [one for name, one in FAULTS.items() if name.startswith(family)]
    if not found:
        raise KeyError(family)
    return [(f"`{one.name}`", one.does) for one in found]


def setting_row(name: str, field: FieldInfo) -> tuple[str, ...]:
    """Return name, default, unit, range and meaning of a setting."""
    units = [one.symbol for one in field.metadata if isinstance(one, Unit)]
    if get_origin(field.annotation) is Literal:
        bounds = [f"`{choice}`" for choice in get_args(field.annotation)]
    else:
        bounds = [
            f"{sign}\N{NO-BREAK SPACE}{getattr(one, attribute):g}"
            for attribute, sign in _BOUNDS.items()
            for one in field.metadata
            if getattr(one, attribute, None) is not None
        ]
    value = field.get_default(call_default_factory=True)
    default = _code(value)
    if isinstance(value, BaseModel):
        name, default = f"{name}.…", ""
    return f"`{name}`", default, "".join(units), ", ".join(bounds), str(field.description)


def settings_models() -> dict[str, tuple[type[BaseModel], str]]:
    """Return settings models by class, and by estimator, with what stands before their names in --set."""
    found: dict[str, tuple[type[BaseModel], str]] = {"RunSettings": (RunSettings, "")}
    for name in _ESTIMATORS:
        found[name] = type(RunSettings.model_fields[name].default), ""
    for model, prefix in list(found.values()):
        for name, field in model.model_fields.items():
            if isinstance(field.default, BaseModel):
                inner = "" if name in _ESTIMATORS else f"{prefix}{name}."
                found.setdefault(type(field.default).__name__, (type(field.default), inner))
    return found | {model.__name__: (model, "") for model in (PlaceSettings, MatchSettings)}


def _default_of(parameter: Any) -> str:  # noqa: ANN401 - typer hides its own click
    if parameter.required:
        return "required"
    if isinstance(told := parameter.show_default, str):
        return told if " " in told else _code(told)
    is_told = parameter.default is not None and parameter.default is not False
    return _code(parameter.default) if is_told and parameter.default != [] else ""


def _code(value: object) -> str:
    value = _plain(value)
    if value is None or value == ():
        return "none"
    shown = str(value).lower() if isinstance(value, bool) else str(value)
    return f"`{value:g}`" if isinstance(value, float) else f"`{shown}`"


def _plain(value: object) -> object:
    return value.value if isinstance(value, Enum) else value


def _markdown(headings: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    """Return a table of the columns that are not empty."""
    columns = [column for column in zip(headings, *rows, strict=True) if any(column[1:])]
    lines = (
        " | ".join(cell.replace("|", r"\|") for cell in row) for row in zip(*columns, strict=True)
    )
    first, *rest = (f"| {line} |" for line in lines)
    return "\n".join([first, "|" + "---|" * len(columns), *rest])
