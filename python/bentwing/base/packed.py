# SPDX-License-Identifier: MIT OR Apache-2.0
"""Nested values as what JSON can hold, with their arrays beside; and back, bit for bit.

Unlike a pickle, what is read makes nothing but values of the classes that the reader names.
"""

from __future__ import annotations

import math
from dataclasses import fields, is_dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

_CLASS, _ARRAY, _TUPLE, _NUMBER = "class", "array", "tuple", "number"


def pack(value: Any) -> tuple[Any, dict[str, NDArray[Any]]]:  # noqa: ANN401 - values of any class
    """Take dataclasses, values with `__getnewargs__`, lists, tuples, arrays and scalars apart."""
    arrays: dict[str, NDArray[Any]] = {}

    def packed(value: Any) -> Any:  # noqa: ANN401 - values of any class
        if isinstance(value, (np.ndarray, np.generic)):
            arrays[str(len(arrays))] = np.asarray(value)
            return {_ARRAY: str(len(arrays) - 1), "scalar": isinstance(value, np.generic)}
        if value is None or isinstance(value, (str, bool, int)):
            return value
        if isinstance(value, float):
            return value if math.isfinite(value) else {_NUMBER: str(value)}
        if isinstance(value, (list, tuple)):
            items = [packed(item) for item in value]
            return {_TUPLE: items} if isinstance(value, tuple) else items
        return {_CLASS: _name(type(value)), "arguments": [packed(a) for a in _arguments(value)]}

    return packed(value), arrays


def unpack(
    packed: Any,  # noqa: ANN401 - what JSON can hold
    arrays: Mapping[str, NDArray[Any]],
    classes: Sequence[type],
) -> Any:  # noqa: ANN401 - one of the classes
    """Put together what `pack` has taken apart.

    Parameters
    ----------
    classes : that may be in it

    Raises
    ------
    LookupError, TypeError, ValueError
        If it has another class, or the class has other attributes now.
    """
    known = {_name(one): one for one in classes}

    def unpacked(packed: Any) -> Any:  # noqa: ANN401 - values of any class
        if isinstance(packed, list):
            return [unpacked(item) for item in packed]
        if not isinstance(packed, dict):
            return packed
        if _NUMBER in packed:
            return float(packed[_NUMBER])
        if _ARRAY in packed:
            array = arrays[packed[_ARRAY]]
            return array[()] if packed["scalar"] else array
        if _TUPLE in packed:
            return tuple(unpacked(item) for item in packed[_TUPLE])
        return known[packed[_CLASS]](*(unpacked(a) for a in packed["arguments"]))

    return unpacked(packed)


def _arguments(value: Any) -> Sequence[Any]:  # noqa: ANN401 - values of any class
    if is_dataclass(value):
        return [getattr(value, field.name) for field in fields(value)]
    arguments: Sequence[Any] = value.__getnewargs__()
    return arguments


def _name(one: type) -> str:
    return f"{one.__module__}.{one.__qualname__}"
