# SPDX-License-Identifier: MIT OR Apache-2.0
"""The papers' figures and tables, made again."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.reproduce.parts import PARTS, Reproduced, reproduce
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(__name__, {"reproduce.parts": ["PARTS", "Reproduced", "reproduce"]})

__all__ = ["PARTS", "Reproduced", "reproduce"]
