# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a global registration will hold in memory, known before it starts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.global_registration.settings import GlobalSettings

# Bytes of a surfel as it is kept, as it is placed with its search grid, and of a match.
SURFEL = 144
PLACED = 500
MATCH = 48
# Matches of a surfel with its own stretch, and with each other visit (measured: at most).
OWN_MATCHES = 1.0
VISIT_MATCHES = 0.45
# A 6 × 6 block of the equations with its place, and how much of the factor beside it is filled.
BLOCK = 330
FACTOR_SHARE = 0.5
# Stretches that are held as placed in the map.
HELD = 96
# Fewer surfels than this share of the usual ones would not carry a registration.
MIN_SHARE = 0.05


@dataclass(frozen=True, slots=True)
class Budget:
    """What fits.

    Attributes
    ----------
    seconds : length of all stretches together
    rate : most surfels per second
    n_surfels : most surfels
    n_unknowns : of the equations
    megabytes : of memory for what is held; the process takes about a fifth more
    is_thinned : whether there would be more surfels if there were more memory
    """

    seconds: float
    rate: float
    n_surfels: int
    n_unknowns: int
    megabytes: float
    is_thinned: bool

    @classmethod
    def of(cls, seconds: float, settings: GlobalSettings) -> Budget:
        """Plan a recording of a length in s."""
        usual = settings.surfels.max_rate
        fixed, each = _fixed(seconds, settings), _each(settings)
        n_usual = usual * seconds
        affordable = (1e6 * settings.memory_mb - fixed) / each
        n = min(n_usual, max(affordable, MIN_SHARE * n_usual))
        return cls(
            seconds=seconds,
            # Exactly the usual one where all fits, whatever the length.
            rate=n / seconds if n < n_usual else usual,
            n_surfels=int(n),
            n_unknowns=_n_unknowns(seconds, settings),
            megabytes=1e-6 * (fixed + each * n),
            is_thinned=n < n_usual,
        )

    def sentence(self) -> str:
        """Say what will be done and held."""
        thinned = f", thinned to {self.rate:,.0f} a second" if self.is_thinned else ""
        return (
            f"{self.seconds:,.0f} s in one system of {self.n_unknowns:,} unknowns, at most "
            f"{self.n_surfels:,} surfels{thinned}, about {self.megabytes:,.0f} MB"
        )


def _n_unknowns(seconds: float, settings: GlobalSettings) -> int:
    return 6 * (int(seconds / settings.interval_for(seconds)) + 3)


def _each(settings: GlobalSettings) -> float:
    """Bytes that grow with the number of surfels."""
    return SURFEL + MATCH * (OWN_MATCHES + VISIT_MATCHES * settings.n_visits)


def _fixed(seconds: float, settings: GlobalSettings) -> float:
    """Bytes that do not depend on the number of surfels."""
    n = _n_unknowns(seconds, settings)
    stretches = seconds / settings.stretch
    # Control points of a stretch; each visit joins all of one with all of the other.
    controls = settings.stretch / settings.interval_for(seconds) + 4
    # No more than there are pairs of control points.
    blocks = min(stretches * (1 + settings.n_visits) * controls**2, (n / 6) ** 2 / 2)
    held = min(HELD, stretches) * settings.stretch * settings.surfels.max_rate * PLACED
    inertial = 100 * seconds * 8 * (2 * 7 * 4 + 7)
    return BLOCK * blocks + 8 * FACTOR_SHARE * n**2 + held + inertial
