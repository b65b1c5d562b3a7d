# SPDX-License-Identifier: MIT OR Apache-2.0
"""A merged map against the truth of its simulated flights."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.run_record import read_record
from bentwing.base.trajectory import Trajectory, read_tum
from bentwing.base.transform import apply
from bentwing.evaluate.alignment import align
from bentwing.evaluate.map import surface_error
from bentwing.evaluate.simulated.truth import Truth, sampled
from bentwing.evaluate.trajectory import absolute_error
from bentwing.map.read import read_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.evaluate.alignment import Alignment

    Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MergedScore:
    """Errors of a merged map.

    Attributes
    ----------
    before, after : m, root mean square, how far the runs are off where the first one is, when all are
        aligned as one; as their places put them, and in the end
    ates : m, in flight, each run aligned by itself
    joint : m, in flight, all runs aligned as one
    map_std, map_ratio : m, and over that of the map made with the truth
    """

    before: float
    after: float
    ates: list[float]
    joint: float
    map_std: float
    map_ratio: float


def merged_score(simulated: Sequence[Path], folder: Path) -> MergedScore:
    """Compare a merged map with its flights, given in the order of the runs."""
    runs = read_record(folder)["runs"]
    truths = [Truth(path) for path in simulated]
    flights = list(zip(truths, runs, strict=True))
    merged = [read_tum(folder / run["trajectory"], truth.origin_ns)[0] for truth, run in flights]
    placed = [_by_places(run, truth.origin_ns) for truth, run in flights]
    alignment, errors = _aligned_as_one(merged, truths)
    world = sampled(read_points(next(folder.glob("map.*")))) @ alignment.R.T + alignment.t
    best = truths[0].distances(np.concatenate([truth.best_points for truth in truths]))
    surface = surface_error(truths[0].distances(world), best=best)
    return MergedScore(
        before=_between(_aligned_as_one(placed, truths)[1]),
        after=_between(errors),
        ates=[
            absolute_error(estimate, truth.trajectory, during=truth.flight).position.rmse
            for estimate, truth in zip(merged, truths, strict=True)
        ],
        joint=_rms(np.concatenate(errors)),
        map_std=surface.std,
        map_ratio=surface.best_ratio or np.nan,
    )


def _by_places(run: dict[str, Any], origin_ns: int) -> Trajectory:
    """Return a run's own trajectory where its places put it; its attitudes stay as they are."""
    own, _ = read_tum(Path(run["folder"]) / "trajectory.txt", origin_ns)
    positions = apply(np.array(run["T_map_run_by_places"]), own.positions)
    return Trajectory(own.times, positions, own.quats_xyzw)


def _aligned_as_one(
    estimates: Sequence[Trajectory], truths: Sequence[Truth]
) -> tuple[Alignment, list[Array]]:
    """Bring all runs together to the truth; returns the errors (N, 3) of each, m, as well."""
    pairs = [_pairs(*flight) for flight in zip(estimates, truths, strict=True)]
    found = align(np.concatenate([e for e, _ in pairs]), np.concatenate([p for _, p in pairs]))
    return found, [e @ found.R.T + found.t - p for e, p in pairs]


def _pairs(estimate: Trajectory, truth: Truth) -> tuple[Array, Array]:
    """Positions (N, 3) of both in flight."""
    first, last = truth.flight
    times = estimate.times[(estimate.times >= first) & (estimate.times <= last)]
    return estimate.interpolate(times)[0], truth.trajectory.interpolate(times)[0]


def _between(errors: Sequence[Array]) -> float:
    """Errors of the other runs beside the mean one of the first, m."""
    return _rms(np.concatenate(errors[1:]) - errors[0].mean(axis=0))


def _rms(errors: Array) -> float:
    return float(np.sqrt((errors**2).sum(axis=1).mean()))
