# SPDX-License-Identifier: MIT OR Apache-2.0
"""Units of settings, as part of their types, so that the documentation can show them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated


@dataclass(frozen=True)
class Unit:
    """Marks a number of a settings model with its unit: `Annotated[float, Unit("m/s")]`."""

    symbol: str


Seconds = Annotated[float, Unit("s")]
Metres = Annotated[float, Unit("m")]
Radians = Annotated[float, Unit("rad")]
