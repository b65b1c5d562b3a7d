# SPDX-License-Identifier: MIT OR Apache-2.0
"""What all effects have in common: how they are drawn, and how a draw is recorded."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


def about(rng: np.random.Generator, size: float, n: int = 1) -> Array:
    """Draw numbers (n,) of about `size`, of either sign.

    A normal draw would be nearly nothing in one recording and thrice the size in the next; what a
    level stands for would then be known only as a mean of many.
    """
    return np.asarray(rng.choice([-1.0, 1.0], n) * rng.uniform(0.7, 1.3, n) * size)


def of_about(rng: np.random.Generator, size: float) -> float:
    """Draw one number of about `size`, of either sign."""
    return float(about(rng, size)[0])


def recorded(effect: Any) -> dict[str, Any]:  # noqa: ANN401 - any dataclass
    """Return the draw of an effect in plain types: its fields, but for those without a `repr`."""
    return {f.name: _plain(getattr(effect, f.name)) for f in fields(effect) if f.repr}


def _plain(value: Any) -> Any:  # noqa: ANN401 - of a draw
    if isinstance(value, np.ndarray):
        return np.round(value, 9).tolist()
    if isinstance(value, float):
        return round(float(value), 9)
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    return value
