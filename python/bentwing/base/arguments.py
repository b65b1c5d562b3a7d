# SPDX-License-Identifier: MIT OR Apache-2.0
"""Arguments of public functions, checked: every refusal names the argument and says what fits."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np

from bentwing.base.threads import MOST_THREADS

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

_T = TypeVar("_T")


def finite_array(name: str, value: ArrayLike, *shape: int | None) -> NDArray[np.float64]:
    """Return numbers as a C-contiguous float64 array; one that is so already is not copied.

    Parameters
    ----------
    name : of the argument
    value : array or nested sequences of any numeric type
    shape : lengths of the axes; None fits any length

    Raises
    ------
    TypeError, ValueError
        If it is not made of numbers, has another shape, or holds NaN or infinity.
    """
    expected = _described(shape)
    try:
        array = np.asarray(value, dtype=np.float64, order="C")
    except (TypeError, ValueError) as error:
        msg = f"{name}: expected numbers of shape {expected}, got {type(value).__name__} ({error})"
        raise TypeError(msg) from None
    fits = array.ndim == len(shape) and all(
        length is None or length == n for length, n in zip(shape, array.shape, strict=True)
    )
    if not fits:
        msg = f"{name}: expected shape {expected}, got {array.shape}"
        raise ValueError(msg)
    finite = np.isfinite(array)
    if not finite.all():
        row = int(np.argmin(finite.reshape(len(array), -1).all(axis=1)))
        msg = f"{name}: row {row} is not finite: {array[row].tolist()}; leave such rows out"
        raise ValueError(msg)
    return array


def in_order(name: str, times: NDArray[np.float64], *, strictly: bool = False) -> None:
    """Refuse times (N,) that decrease, or with `strictly` that do not increase."""
    steps = np.diff(times)
    wrong = steps <= 0 if strictly else steps < 0
    if wrong.any():
        row = int(np.argmax(wrong)) + 1
        rule = "must increase" if strictly else "must not decrease"
        msg = f"{name}: {rule}, but row {row} is {times[row]:.9g} s after {times[row - 1]:.9g} s"
        raise ValueError(msg)


def instance(name: str, value: object, kind: type[_T], remedy: str) -> _T:
    """Return a value that is of a type, or raise TypeError with the remedy."""
    if isinstance(value, kind):
        return value
    msg = f"{name}: expected {_with_article(kind.__name__)}, got {type(value).__name__}; {remedy}"
    raise TypeError(msg)


def thread_count(threads: int | None) -> int:
    """Return the number of threads as the core takes it: zero for all cores."""
    if threads is None:
        return 0
    count = instance("threads", threads, int, "give a number from 1 on, or None for all cores")
    if not 1 <= count <= MOST_THREADS:
        msg = f"threads: expected a number from 1 to {MOST_THREADS}, or None for all cores, got {count}"
        raise ValueError(msg)
    return count


def _described(shape: tuple[int | None, ...]) -> str:
    lengths = ["N" if length is None else str(length) for length in shape]
    return f"({', '.join(lengths)}{',' if len(lengths) == 1 else ''})"


def _with_article(word: str) -> str:
    return f"{'an' if word[0] in 'AEIOUaeiou' else 'a'} {word}"
