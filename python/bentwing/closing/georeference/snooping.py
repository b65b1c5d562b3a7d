# SPDX-License-Identifier: MIT OR Apache-2.0
"""Marks that contradict the others: one at a time is left out, and what is left compared (data snooping).

References: W. Baarda, A Testing Procedure for Use in Geodetic Networks, 1968.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

from bentwing.base.errors import NotEnoughDataError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.closing.georeference.marks import Marks
    from bentwing.closing.georeference.placement import Placement

LEAST = 0.03  # m; what is off by less harms no map
_LEVEL = 0.01  # chance that good marks are doubted
_PRIOR = 8.0  # measurements that the stated accuracies are worth beside what the marks show
_CLOSE = (
    9.0  # squared, in units of the noise: leaving out one mark or another explains equally much
)
_UNKNOWNS = 4


class Fit(Protocol):
    """Fits heading and place to some of the marks."""

    def __call__(self, numbers: Sequence[int]) -> Placement:
        """Return where the marks of these numbers put the map."""


@dataclass(frozen=True, slots=True)
class Contradiction:
    """A mark that is somewhere else than the others say.

    Attributes
    ----------
    number : of the mark
    off : m, from where the others put it
    rivals : numbers of marks that may be the false one as well
    """

    number: int
    off: float
    rivals: tuple[int, ...] = ()

    @property
    def is_certain(self) -> bool:
        """Whether it is this mark, and no other, that is false."""
        return not self.rivals

    def record(self, marks: Marks) -> dict[str, Any]:
        """Return what run.json says about it."""
        names = [marks.listed[number].name for number in (self.number, *self.rivals)]
        return {"marks": names, "off": self.off, "used": self.number not in marks.false}


def contradictions(marks: Marks, fit: Fit, n_known: int = 0) -> list[Contradiction]:
    """Find the marks that contradict the others, the worst first.

    Parameters
    ----------
    marks : measured
    fit : places the map by some of them
    n_known : measurements of the place beside the marks, as GNSS fixes are
    """
    left = [number for number in range(len(marks.listed)) if marks.n_measured(number)]
    fewest = 1 if n_known else 2
    found: list[Contradiction] = []
    while len(left) >= fewest:
        worst = _worst(marks, fit, left, n_known)
        if worst is None:
            break
        found.append(worst)
        if worst.rivals:
            break
        left.remove(worst.number)
    return found


def _worst(marks: Marks, fit: Fit, left: Sequence[int], n_known: int) -> Contradiction | None:
    try:
        everywhere = fit(left)
    except NotEnoughDataError:
        return None
    whole, tried = _misfit(marks, everywhere, left), []
    for number in left:
        others = [other for other in left if other != number]
        try:
            placement = fit(others)
        except NotEnoughDataError:
            continue
        tried.append((_misfit(marks, placement, others), number, marks.off(number, placement)))
    if len(tried) < len(left):
        tried = [(0.0, number, marks.off(number, everywhere)) for number in left]
    best, number, off = min(tried, key=lambda one: (one[0], -one[2]))
    n_all, n = sum(marks.n_measured(other) for other in left), marks.n_measured(number)
    free = max(n_all - n + n_known - _UNKNOWNS, 0)
    noise = (_PRIOR + best) / (_PRIOR + free)
    if off < LEAST or _chance((whole - best) / n / noise, n, _PRIOR + free) > _LEVEL / len(left):
        return None
    rivals = [
        other for misfit, other, _ in tried if other != number and misfit - best < _CLOSE * noise
    ]
    return Contradiction(number, off, tuple(rivals))


def _misfit(marks: Marks, placement: Placement, numbers: Sequence[int]) -> float:
    """Sum of the squared residuals of marks, in units of their noise."""
    return float(sum(marks.misfit(number, placement) for number in numbers))


def _chance(ratio: float, n: float, free: float) -> float:
    """Probability that a ratio of variances is larger by chance."""
    from scipy.special import fdtrc

    return float(fdtrc(n, free, max(ratio, 0.0)))
