# SPDX-License-Identifier: MIT OR Apache-2.0
"""Every number that a user can set has a range with two ends: no value can exhaust the machine."""

from __future__ import annotations

from typing import get_args

import pytest
from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel

from bentwing.closing.places.settings import MatchSettings, PlaceSettings
from bentwing.run.settings import MergeSettings, RunSettings
from bentwing.simulate import Scenario


def inner(annotation):
    """The models in an annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from inner(argument)


def models(*roots):
    found, waiting = [], list(roots)
    while waiting:
        model = waiting.pop()
        if model not in found:
            found.append(model)
            waiting += [m for f in model.model_fields.values() for m in inner(f.annotation)]
    return found


def parts(annotation):
    """An annotation and what it is made of."""
    return {annotation, *(p for a in get_args(annotation) for p in parts(a))}


def ends(field):
    """Which ends of its range a number has, and those of the numbers in a tuple."""
    metadata = [*field.metadata, *(m for a in nested(field.annotation) for m in a.__metadata__)]
    metadata = [getattr(m, "metadata", [m]) for m in metadata]
    flat = [m for one in metadata for m in (one if isinstance(one, list) else [one])]
    return any(isinstance(m, (Ge, Gt)) for m in flat), any(isinstance(m, (Le, Lt)) for m in flat)


def nested(annotation):
    found = [annotation] if hasattr(annotation, "__metadata__") else []
    return found + [n for a in get_args(annotation) for n in nested(a)]


NUMBERS = [
    pytest.param(field, id=f"{model.__name__}.{name}")
    for model in models(RunSettings, MergeSettings, PlaceSettings, MatchSettings, Scenario)
    for name, field in model.model_fields.items()
    if parts(field.annotation) & {int, float}
    and not list(inner(field.annotation))
    and not {getattr(p, "__origin__", p) for p in parts(field.annotation)} & {tuple, dict}
]


@pytest.mark.parametrize("field", NUMBERS)
def test_a_number_has_a_least_and_a_greatest_value(field):
    assert ends(field) == (True, True)
