# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the fixes of each of several runs say of where they were put together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.plain import plain
from bentwing.closing.georeference.placement import GATE, independent_share

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.georeference.receivers import Receivers

    Array = NDArray[np.float64]

LEAST = 0.05  # m; runs are not put together better by what they have in common


@dataclass(frozen=True, slots=True)
class Share:
    """The fixes of one run among those of several.

    Attributes
    ----------
    name : of the run
    used, rejected : number of fixes
    offset : (3,) m, median of map less fixes, east, north, up; None without a fix
    disagrees : whether that is more than the noise of the fixes explains
    """

    name: str
    used: int
    rejected: int
    offset: Array | None
    disagrees: bool

    def to_json(self) -> dict[str, Any]:
        """Return the share as run.json has it."""
        described: dict[str, Any] = plain(
            {
                "name": self.name,
                "used": self.used,
                "rejected": self.rejected,
                "offset": self.offset,
                "disagrees": self.disagrees,
            }
        )
        return described

    def sentence(self) -> str:
        """Say that the run lies elsewhere than its receiver says."""
        off = 0.0 if self.offset is None else float(np.linalg.norm(self.offset))
        n = self.used + self.rejected
        return (
            f"{self.name} lies {off:.2f} m from its GNSS fixes, where what it has in common with the "
            f"other runs puts it ({self.rejected} of its {n} fixes are not used): check its receiver "
            "and base station, and whether the runs show the same place"
        )


def shares_of(receivers: Receivers, gaps: Array, used: NDArray[np.bool_]) -> list[Share]:
    """Return what the fixes of each run say.

    Parameters
    ----------
    gaps : (N, 3) m, map less fixes, east, north, up
    used : (N,) whether each fix is
    """
    found = []
    for number, name in enumerate(receivers.names):
        own = receivers.runs == number
        n_used, n = int(np.count_nonzero(used & own)), int(np.count_nonzero(own))
        offset = np.median(gaps[own], axis=0) if n else None
        disagrees = offset is not None and _is_far(offset, receivers, own)
        found.append(Share(name, n_used, n - n_used, offset, disagrees))
    return found


def _is_far(offset: Array, receivers: Receivers, own: NDArray[np.bool_]) -> bool:
    fixes = receivers.fixes
    n_independent = max(1.0, np.count_nonzero(own) * independent_share(fixes.times[own]))
    covariance = fixes.covariances[own].mean(axis=0) / n_independent + LEAST**2 / GATE * np.eye(3)
    return bool(offset @ np.linalg.solve(covariance, offset) > GATE)
