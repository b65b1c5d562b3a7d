# SPDX-License-Identifier: MIT OR Apache-2.0
"""Turns what pydantic finds wrong with values into one clear sentence."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING, Any, get_args

from pydantic import BaseModel

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from pydantic import ValidationError
    from pydantic_core import ErrorDetails


def describe(error: ValidationError, model: type[BaseModel], source: Path | str) -> str:
    """Return one sentence that names every problem with its source and key path."""
    problems = "; ".join(_problem(item, model) for item in error.errors(include_url=False))
    return f"{source}: {problems}"


def _problem(item: ErrorDetails, model: type[BaseModel]) -> str:
    location = item["loc"]
    if item["type"] == "extra_forbidden":
        return _unknown_key(location, model)
    where = f"{_key_path(location)}: " if location else ""
    if item["type"] == "missing":
        return f"{where}required, but not given"
    message = item["msg"].removeprefix("Value error, ")
    message = message[:1].lower() + message[1:]
    # Problems raised by our own validators carry their numbers already.
    found = "" if item["type"] == "value_error" else f", found {_short(item['input'])}"
    return f"{where}{message}{found}"


def _unknown_key(location: Sequence[int | str], model: type[BaseModel]) -> str:
    *parents, key = location
    names = _names_at(parents, model)
    near = difflib.get_close_matches(str(key), names, n=1, cutoff=0.5)
    hint = f"did you mean '{near[0]}'?" if near else f"valid are {', '.join(names)}"
    prefix = f"{_key_path(parents)}: " if parents else ""
    return f"{prefix}unknown key '{key}'; {hint}"


def _names_at(location: Sequence[int | str], model: type[BaseModel]) -> list[str]:
    """Return the valid keys of the section at `location`, found by walking the models."""
    for key in location:
        if isinstance(key, int):
            continue
        field = model.model_fields.get(str(key))
        inner = None if field is None else _model_in(field.annotation)
        if inner is None:
            break
        model = inner
    names = [field.alias or name for name, field in model.model_fields.items()]
    return [*names, *getattr(model, "also_accepted", ())]


def _model_in(annotation: Any) -> type[BaseModel] | None:  # noqa: ANN401 - any annotation
    """Return the model inside annotations such as `Imu | None` or `tuple[SelfHit, ...]`."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in get_args(annotation):
        if (found := _model_in(argument)) is not None:
            return found
    return None


def _key_path(location: Sequence[int | str]) -> str:
    text = ""
    for key in location:
        text += f"[{key}]" if isinstance(key, int) else f".{key}" if text else str(key)
    return text


def _short(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."
