# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a reproduced part consists of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing as SVG, the name of its file, a title, and what it shows beside the paper's."""

    name: str
    drawing: str
    title: str
    note: str


@dataclass(frozen=True, slots=True)
class Part:
    """Figures on one page, and the numbers behind them."""

    title: str
    figures: list[Figure]
    numbers: dict[str, Any] = field(default_factory=dict)
