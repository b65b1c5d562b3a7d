# SPDX-License-Identifier: MIT OR Apache-2.0
"""Dataclasses with arrays that can be compared."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np


class Value:
    """Base of dataclasses made with `eq=False`: equal if all fields are, arrays element by element.

    What a dataclass generates would raise, as the truth of an array is not defined.
    """

    __slots__ = ()
    # Else an array on the other side of == would take the value for a sequence.
    __array_ufunc__ = None

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        value: Any = self  # a dataclass, which the type of this base cannot say
        names = [field.name for field in fields(value) if field.compare]
        return all(_are_equal(getattr(self, name), getattr(other, name)) for name in names)


def _are_equal(a: object, b: object) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.array_equal(np.asarray(a), np.asarray(b))
    return a is b or a == b
