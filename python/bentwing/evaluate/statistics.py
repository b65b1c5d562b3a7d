# SPDX-License-Identifier: MIT OR Apache-2.0
"""How measured errors are summarized."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

SAMPLES: dict[str, bool] = {"samples": True}
"""Metadata of the fields that hold single measurements: drawn in figures, left out of the JSON."""


@dataclass(frozen=True, slots=True)
class Statistics:
    """Summary of errors that are not negative, in their unit, as evo names them."""

    rmse: float
    mean: float
    median: float
    std: float
    minimum: float
    maximum: float
    n: int

    @classmethod
    def of(cls, errors: NDArray[np.float64]) -> Statistics:
        """Summarize errors `(N,)`, N > 0."""
        return cls(
            float(np.sqrt(np.mean(errors**2))),
            float(errors.mean()),
            float(np.median(errors)),
            float(errors.std()),
            float(errors.min()),
            float(errors.max()),
            len(errors),
        )


@dataclass(frozen=True, slots=True)
class Box:
    """A boxplot of signed errors, in their unit.

    The box is the interquartile range, the whiskers are the 3rd and the 97th percentile.

    References
    ----------
    Kaul 2015, figure 24.
    """

    p3: float
    p25: float
    median: float
    p75: float
    p97: float
    mean: float
    std: float
    n: int

    @classmethod
    def of(cls, errors: NDArray[np.float64]) -> Box:
        """Summarize errors `(N,)`, N > 0."""
        p3, p25, median, p75, p97 = np.percentile(errors, [3, 25, 50, 75, 97]).tolist()
        return cls(
            p3, p25, median, p75, p97, float(np.mean(errors)), float(np.std(errors)), len(errors)
        )


def summary(value: Any) -> Any:  # noqa: ANN401 - takes and returns whatever a result holds
    """Turn dataclasses into dictionaries without their fields of single measurements."""
    if is_dataclass(value) and not isinstance(value, type):
        kept = [field.name for field in fields(value) if not field.metadata.get("samples")]
        return {name: summary(getattr(value, name)) for name in kept}
    if isinstance(value, dict):
        return {key: summary(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [summary(item) for item in value]
    return value
