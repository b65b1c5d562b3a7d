# SPDX-License-Identifier: MIT OR Apache-2.0
"""Which stretches of a recording are matched with which, as the core takes it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class MatchingPlan:
    """Fields of the core's plan.

    Attributes
    ----------
    n_visits : other visits a stretch is matched with; as many again may choose it
    min_overlap : least share of the places of a stretch that another must have seen
    n_held : stretches that are held as placed in the map
    posterior_interval : s, between the knots by which covariances are computed
    """

    n_visits: int
    min_overlap: float
    n_held: int
    posterior_interval: float
