# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate and its recording to where the beams of the lidar truly point to."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.beams.cells import find_cells
from bentwing.closing.beams.found import FoundBeams, are_off
from bentwing.closing.beams.shots import sample_shots
from bentwing.closing.beams.system import FIRST_SIGMAS, N_OFFSETS, knots_of, shown_sigmas, solve

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.closing.beams.shots import Shots
    from bentwing.recording import Batch, Payload

    Array = NDArray[np.float64]

ITERATIONS = (5, 10)
"""At least and at most."""
SMALL = np.array([np.radians(0.005), np.radians(0.005), 5e-4, 5e-4])
"""A step of the beams that ends the iterations."""
MEDIAN_IN_SIGMAS = 0.6745
"""Of the absolute value of a normal variable."""
MAX_ANGLE = np.radians(1.0)
"""A beam that seems farther off has been seen too little."""
MIN_CELLS = 100
"""Planes without which nothing is said."""


def find_beams(estimate: Estimate, batches: Iterable[Batch], payload: Payload) -> FoundBeams | None:
    """Find by how much the beams are off, together with the poses; None where they are hardly off.

    Parameters
    ----------
    batches : of the recording the estimate is of, read with `payload`
    """
    known = payload.lidar.beams
    first = sample_shots(batches, estimate, () if known is None else known.table)
    if first is None or first.n_beams < 2:
        return None
    shots, beams, sigmas = first, np.zeros((first.n_beams, N_OFFSETS)), FIRST_SIGMAS
    before, shares, _ = knots_of(first.times)
    behind = shares[:, None]
    for iteration in range(ITERATIONS[1]):
        cells = find_cells(shots.points(), shots.times, iteration)
        if cells.n_cells < MIN_CELLS:
            return None
        step = solve(shots, cells, beams, sigmas, payload.lidar.range_sigma)
        poses = (1.0 - behind) * step.poses[before] + behind * step.poses[before + 1]
        shots = shots.moved(poses[:, :3], poses[:, 3:], step.beams)
        beams = beams + step.beams
        sigmas = shown_sigmas(beams, step.covariance)
        settled = not are_off(beams) or (np.abs(step.beams) < SMALL).all()
        if iteration + 1 >= ITERATIONS[0] and settled:
            break
    if not are_off(beams):
        return None
    thickness = _thickness(first, shots, beams)
    beams[(np.abs(beams[:, :2]) > MAX_ANGLE).any(axis=1), :3] = 0.0
    return FoundBeams(
        beams,
        np.sqrt(np.diag(step.covariance)).reshape(beams.shape),
        _table(first),
        cells.n_cells,
        len(cells.chosen),
        thickness,
    )


def _table(shots: Shots) -> Array:
    """Elevation of each beam as it was recorded (B,), rad; 0 of one that was never seen."""
    counts = np.maximum(np.bincount(shots.rings, minlength=shots.n_beams), 1)
    table: Array = np.bincount(shots.rings, shots.elevations, shots.n_beams) / counts
    return table


def _thickness(recorded: Shots, found: Shots, beams: Array) -> tuple[float, float]:
    """Return how rough the planes are by the beams as recorded and as found, m.

    What better poses gain is not the beams' doing: those recorded are judged from whichever poses suit
    them better, those they were recorded with or those that were found.
    """
    still = np.zeros((len(found.times), 3))
    without = found.moved(still, still, -beams)
    return min(_roughness(recorded), _roughness(without)), _roughness(found)


def _roughness(shots: Shots) -> float:
    """How far returns are off their planes, m: the standard deviation that the median tells."""
    cells = find_cells(shots.points(), shots.times, 0)
    return float(np.median(np.abs(cells.across)) / MEDIAN_IN_SIGMAS)
