# SPDX-License-Identifier: MIT OR Apache-2.0
"""Beams that have a width: at the edges of things they return from both sides, or from between."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from bentwing.simulate.realism.ranges import BEAM_WIDTH

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.ranging import Body

    Array = NDArray[np.float64]

EchoName = Literal["first", "strongest", "blended"]
ECHOES: tuple[EchoName, ...] = ("first", "strongest", "blended")
N_AROUND = 6
"""Sub-rays around the central one."""
PULSE = 0.6
"""m, length of a pulse: echoes nearer to each other become one."""
NOWHERE = 1e6
"""m, depth of what does not return."""
EDGE = 0.05
"""m, bend of the profile between three neighbouring shots from which on there is an edge."""


@dataclass(frozen=True, slots=True)
class Divergence:
    """The surfaces as a beam of some width sees them.

    Only shots next to an edge are cast again with sub-rays: on a plane these agree on average.

    Attributes
    ----------
    half_width : rad
    echo : which of several echoes is reported
    """

    half_width: float
    echo: EchoName
    body: Body = field(repr=False)

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Ranges (N,) and cosines of incidence (N,)."""
        ranges, cosines = self.body.cast(beams, origins, directions)
        at = np.flatnonzero(_edges(ranges.reshape(beams.times.shape), beams.sweep_axis))
        if len(at):
            around = self._around(beams, origins[at], directions[at], at)
            ranges[at] = reported(np.vstack([ranges[at], around]), self.echo)
        return ranges, cosines

    def _around(
        self, beams: Beams, origins: Array, directions: Array, at: NDArray[np.intp]
    ) -> Array:
        """Ranges (N_AROUND, K) of the sub-rays."""
        helper = np.where(abs(directions[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
        u = np.cross(directions, helper)
        u /= np.linalg.norm(u, axis=1)[:, None]
        v = np.cross(directions, u)
        rows = []
        for angle in 2 * np.pi * np.arange(N_AROUND) / N_AROUND:
            aside = self.half_width * (np.cos(angle) * u + np.sin(angle) * v)
            ray = directions + aside
            ray /= np.linalg.norm(ray, axis=1)[:, None]
            rows.append(self.body.cast(_chosen(beams, at), origins, ray)[0])
        return np.array(rows)


def reported(echoes: Array, echo: EchoName) -> Array:
    """Return the range (K,) that a lidar makes of the ranges of its sub-rays (S, K)."""
    if echo == "first":
        nearest: Array = echoes.min(axis=0)
        return nearest
    finite = np.isfinite(echoes)
    depths = np.where(finite, echoes, NOWHERE)
    # Sub-rays within a pulse's length of one another return as one.
    together = (abs(depths[:, None] - depths[None]) < PULSE) & finite[:, None] & finite[None]
    best = together.sum(axis=1).argmax(axis=0) if echo == "strongest" else depths.argmin(axis=0)
    members = together[best, :, np.arange(echoes.shape[1])].T
    n = members.sum(axis=0)
    total = np.where(members, depths, 0.0).sum(axis=0)
    return np.where(n > 0, total / np.maximum(n, 1), np.inf)


def _edges(ranges: Array, axis: int) -> NDArray[np.bool_]:
    """Tell which shots have a neighbour at another depth."""
    finite = np.where(np.isfinite(ranges), ranges, NOWHERE)
    before, after = np.roll(finite, 1, axis=axis), np.roll(finite, -1, axis=axis)
    bend = abs(before - 2 * finite + after)
    return np.asarray(bend > EDGE + 0.01 * np.minimum(np.minimum(before, after), finite))


def _chosen(beams: Beams, at: NDArray[np.intp]) -> Beams:
    times, directions = beams.times.ravel()[at], beams.directions.reshape(-1, 3)[at]
    return replace(beams, times=times[:, None], directions=directions[:, None])


def draw_divergence(rng: np.random.Generator, level: float, body: Body) -> Divergence:
    """Draw which echo is reported, and a half width of 1.5 mrad that grows up to twice of it."""
    wide = 0.5 * BEAM_WIDTH * min(level, 2.0)
    return Divergence(wide, ECHOES[rng.integers(len(ECHOES))], body)
