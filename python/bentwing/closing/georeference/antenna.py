# SPDX-License-Identifier: MIT OR Apache-2.0
"""Where on the carrier the antenna is, as far as the fixes show it: its place turns with the carrier.

The errors of fixes wander, so a shift of every 20 s is unknown too, and only what changes faster says where
the antenna is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.closing.georeference.placement import GATE, INDEPENDENT, MEDIAN

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.closing.georeference.placement import Placement
    from bentwing.closing.georeference.site import Site

    Array = NDArray[np.float64]

_UNKNOWN = 1.0  # m, by which an antenna may be off that nobody doubts
_CLEAR, _FAR = 5.0, 0.05  # standard deviations, and m: then its place is wrong
_ITERATIONS = 10
_CONVERGED = 1e-6


@dataclass(frozen=True, slots=True)
class Antenna:
    """The antenna of one run.

    Attributes
    ----------
    run : number of the run
    name : of the run
    moved : (3,) m, from where the payload has it, IMU frame
    std : (3,) m
    is_free : whether the payload leaves it to the fixes
    lever_arm : (3,) m, where the fixes have it
    """

    run: int
    name: str
    moved: Array
    std: Array
    is_free: bool
    lever_arm: Array

    @property
    def is_elsewhere(self) -> bool:
        """Whether it clearly is where the payload does not have it."""
        clear = np.abs(self.moved) > np.maximum(_CLEAR * self.std, _FAR)
        return bool(clear.any())

    def record(self) -> dict[str, Any]:
        """Return what run.json says about it."""
        return {
            "run": self.name,
            "lever_arm": self.lever_arm,
            "std": self.std,
            "used": self.is_free,
        }

    def sentence(self) -> str:
        """Say that it is elsewhere, and what to do."""
        of = f" of {self.name}" if self.name else ""
        x, y, z = self.lever_arm
        return (
            f"the GNSS fixes{of} have the antenna {np.linalg.norm(self.moved):.2f} m from where the payload "
            f"has it, at [{x:.2f}, {y:.2f}, {z:.2f}] in the IMU frame: correct gnss.lever_arm, or state "
            "gnss.lever_arm_std, by which it may be off"
        )


def find_antennas(site: Site, placement: Placement) -> list[Antenna]:
    """Find the antenna of each run; none where there are no fixes.

    Parameters
    ----------
    site : with fixes
    placement : of the map, by the fixes
    """
    if site.receivers is None:
        return []
    return [
        antenna
        for run in range(len(site.receivers.names))
        if (antenna := _find(site, placement, run)) is not None
    ]


def _find(site: Site, placement: Placement, run: int) -> Antenna | None:
    receivers = site.receivers
    assert receivers is not None
    own = receivers.runs == run
    if np.count_nonzero(own) < 10:
        return None
    std = receivers.lever_stds[run]
    prior = np.eye(3) / (std or _UNKNOWN) ** 2
    level = placement.rotation
    axes = level @ geometry.to_matrices(site.original.interpolate(site.times[own])[1])
    gaps = placement.to_level(site.positions.points[own]) - site.positions.targets[own]
    points = site.positions.points[own] @ level.T
    rows = np.concatenate([np.cross([0.0, 0.0, 1.0], points)[..., None], axes], axis=2)
    weights = np.linalg.inv(site.positions.covariances[own])
    stretch = np.floor((site.times[own] - site.times[own][0]) / INDEPENDENT).astype(np.intp)
    found, covariance = np.zeros(4), np.eye(4)
    used, scale = np.ones(len(gaps), np.bool_), 1.0
    for _ in range(_ITERATIONS):
        left, lines = _centred(gaps, stretch, used), _centred(rows, stretch, used)
        kept, weighted = lines[used], weights[used] / scale
        information = np.einsum("nia,nij,njb->ab", kept, weighted, kept)
        information[1:, 1:] += prior
        information[0, 0] += 1.0
        covariance = np.linalg.inv(information)
        step = -covariance @ np.einsum("nia,nij,nj->a", kept, weighted, left[used])
        squared = np.einsum("ni,nij,nj->n", left + lines @ step, weights, left + lines @ step)
        scale = max(float(np.median(squared[used])) / MEDIAN, 1e-6)
        used = squared < GATE * scale
        done, found = np.abs(step - found).max() < _CONVERGED, step
        if done:
            break
    lever = receivers.lever_arms[own][0] + found[1:]
    stds = np.sqrt(np.diag(covariance))[1:]
    return Antenna(run, receivers.names[run], found[1:], stds, std > 0.0, lever)


def _centred(values: Array, stretch: NDArray[np.intp], used: NDArray[np.bool_]) -> Array:
    """Take from values (N, …) the mean of those of the same stretch that are used."""
    counts = np.maximum(np.bincount(stretch, used), 1.0)
    sums = np.zeros((len(counts), *values.shape[1:]))
    np.add.at(sums, stretch[used], values[used])
    centred: Array = values - (sums.T / counts).T[stretch]
    return centred
