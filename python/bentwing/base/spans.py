# SPDX-License-Identifier: MIT OR Apache-2.0
"""Spans of time in which something holds, and how a sentence names them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

Span = tuple[float, float]
"""First and last time, s."""
_MOST = 3


def spans_of(flagged: Iterable[tuple[float, bool]]) -> list[Span]:
    """Return the spans of steps that are flagged.

    Parameters
    ----------
    flagged : end of each step, s, in order, and whether it is flagged; a step begins where the one
        before it ends, the first one at zero
    """
    spans: list[Span] = []
    before = 0.0
    for end, holds in flagged:
        if holds:
            first = spans.pop()[0] if spans and spans[-1][1] == before else before
            spans.append((first, end))
        before = end
    return spans


def name_spans(
    spans: Sequence[Span],
    *,
    one: Callable[[float, float], str] = lambda first, last: f"from {first:.1f} to {last:.1f} s",
    others: Callable[[int], str] = lambda n: f"{n} shorter time{'s' if n > 1 else ''}",
    conjunction: str = "and",
) -> str:
    """Return `from 3.0 to 4.5 s and from 8.0 to 9.0 s`; of many spans the longest ones."""
    longest = sorted(sorted(spans, key=lambda s: s[0] - s[1])[:_MOST])
    named = [one(first, last) for first, last in longest]
    if left := len(spans) - len(named):
        named.append(others(left))
    return f" {conjunction} ".join(filter(None, (", ".join(named[:-1]), named[-1])))
