# SPDX-License-Identifier: MIT OR Apache-2.0
"""What settings and measurements of a controller have to be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Mapping


def require_positive(values: Mapping[str, float]) -> None:
    """Refuse settings that are not finite numbers above zero.

    Raises
    ------
    UsageError
        Names the first of them.
    """
    for name, value in values.items():
        if not (math.isfinite(value) and value > 0):
            msg = f"{name}: expected a finite number above zero, got {value}"
            raise UsageError(msg)


def fault(name: str, value: float, most: float) -> str | None:
    """Say why a measurement cannot be used, None if it can: not finite, or beyond ±`most`."""
    if not math.isfinite(value):
        return f"{name} is {value}"
    return None if abs(value) <= most else f"{name} of {value:.4g} is beyond {most:.4g}"


def age_fault(name: str, age: float, most: float) -> str | None:
    """Say why a stamp cannot be used, None if it can: not finite, from the future, or too old."""
    if not math.isfinite(age):
        return f"{name} has no finite time"
    if age < 0:
        return f"{name} is {-age:.3f} s from the future"
    return None if age <= most else f"{name} is {age:.3f} s old"
