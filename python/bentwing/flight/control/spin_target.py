# SPDX-License-Identifier: MIT OR Apache-2.0
"""How fast to spin here: rich structure faster and so steadier, open terrain slower and denser.

What Kaul 2015 proposes in section 3.2.3: the target rate from the distribution of surfel normals.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import UsageError
from bentwing.flight.control.checks import require_positive

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

ISOTROPIC = 1.0 / 3.0
"""The smallest eigenvalue of the normals' moments if all directions are seen equally."""


@dataclass(frozen=True, slots=True)
class SpinTarget:
    """Maps structure to a rate between `slowest` and `fastest`, rad/s (the planned range).

    Attributes
    ----------
    poor : support below which the slowest rate is needed
    rich : support above which the fastest is good; the support is 1 if normals are isotropic
    n_enough : fewer surfels say nothing, and the slowest rate is kept
    """

    slowest: float
    fastest: float
    poor: float = 0.05
    rich: float = 0.4
    n_enough: int = 200

    def __post_init__(self) -> None:
        require_positive({"slowest": self.slowest, "poor": self.poor, "n_enough": self.n_enough})
        if not (self.slowest < self.fastest < np.inf and self.poor < self.rich <= 1.0):
            msg = f"slowest < fastest and poor < rich ≤ 1: expected, got {self}"
            raise UsageError(msg)

    def rate(self, normals: ArrayLike) -> float:
        """Return the rate for surfel normals (N, 3) of the last window, in any frame.

        Raises
        ------
        ValueError
            If they are not of this shape or not finite.
        """
        support = structure_support(normals)
        if len(np.atleast_2d(normals)) < self.n_enough:
            return self.slowest
        share = np.clip((support - self.poor) / (self.rich - self.poor), 0.0, 1.0)
        return float(self.slowest + share * (self.fastest - self.slowest))


def structure_support(normals: ArrayLike) -> float:
    """Return how well normals (N, 3) span space, 0 (a direction unseen) to 1 (all alike).

    The smallest eigenvalue of the mean of n nᵀ: the share of surfaces that face the direction
    that fewest of them face, in units of the isotropic share.
    """
    table = np.asarray(normals, np.float64)
    if table.ndim != 2 or table.shape[1] != 3:
        msg = f"normals: expected shape (N, 3), got {table.shape}"
        raise ValueError(msg)
    if not np.isfinite(table).all():
        row = int(np.argmin(np.isfinite(table).all(axis=1)))
        msg = f"normals: row {row} is not finite: {table[row]}"
        raise ValueError(msg)
    lengths = np.linalg.norm(table, axis=1, keepdims=True)
    unit = table / np.where(lengths > 0, lengths, 1.0)
    if not len(unit):
        return 0.0
    smallest = float(np.linalg.eigvalsh(unit.T @ unit / len(unit))[0])
    return float(np.clip(smallest / ISOTROPIC, 0.0, 1.0))
