# SPDX-License-Identifier: MIT OR Apache-2.0
"""Goes through a recording once more: surfels of its stretches, and its inertial samples."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.odometry.core_states import core_globals, core_samples
from bentwing.recording import ImuBatch, LidarBatch

if TYPE_CHECKING:
    from collections.abc import Iterable

    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry.continuous.settings import SurfelSettings
    from bentwing.recording import Batch


@dataclass(slots=True)
class Stretches:
    """What was seen along a segment of the trajectory.

    Attributes
    ----------
    trajectory : the segment
    surfels : of consecutive stretches, in order of time
    """

    trajectory: Trajectory
    surfels: list[_core.Surfels] = field(default_factory=list)


def segments_of(estimate: Estimate) -> list[Trajectory]:
    """Return the stretches of the trajectory without a break that are long enough to be moved."""
    whole = estimate.trajectory
    cut = [whole.within([span]) for span in estimate.spans]
    return [t for t in cut if len(t.times) > 1]


def length_of(estimate: Estimate) -> float:
    """Return the length of all segments together, s."""
    return sum(float(t.times[-1] - t.times[0]) for t in segments_of(estimate))


def interval_of(estimate: Estimate) -> float:
    """Return the time between two poses, s."""
    times = estimate.trajectory.times
    return float(times[-1] - times[0]) / (len(times) - 1)


def collect(
    batches: Iterable[Batch],
    estimate: Estimate,
    *,
    length: float,
    settings: SurfelSettings,
    range_sigma: float,
    threads: int,
) -> tuple[list[Stretches], ImuBatch]:
    """Make the surfels of all segments, with the poses and the calibration of the estimate.

    Parameters
    ----------
    batches : of the recording the estimate is of
    length : of a stretch, s
    """
    collector = Collector(
        estimate, length=length, settings=settings, range_sigma=range_sigma, threads=threads
    )
    for batch in batches:
        collector.add(batch)
    return collector.result()


class Collector:
    """The same, batch by batch as they come; parameters as of `collect`."""

    def __init__(
        self,
        estimate: Estimate,
        *,
        length: float,
        settings: SurfelSettings,
        range_sigma: float,
        threads: int,
    ) -> None:
        segments = segments_of(estimate)
        self._found = [Stretches(t) for t in segments]
        self._samples = [core_samples(t) for t in segments]
        self._slow = core_globals(estimate.calibration)
        self._measured = estimate.calibration.measured
        self._length, self._settings, self._threads = length, settings, threads
        self._range_sigma = range_sigma
        self._number = 0
        self._held: list[LidarBatch] = []
        self._inertial: list[ImuBatch] = []

    def add(self, batch: Batch) -> None:
        """Take the next batch of the recording."""
        if isinstance(batch, ImuBatch):
            self._inertial.append(batch)
        elif isinstance(batch, LidarBatch) and len(batch.times):
            self._cut(batch)

    def result(self) -> tuple[list[Stretches], ImuBatch]:
        """Finish with what was added."""
        self._extract()
        return self._found, ImuBatch.joined(self._inertial)

    def _cut(self, batch: LidarBatch) -> None:
        """Divide points by stretches; those outside the segments are passed over."""
        times = self._measured(batch.times)
        while self._number < len(self._found):
            span = self._found[self._number].trajectory.times
            inside = (times >= span[0]) & (times <= span[-1])
            if inside.any():
                self._hold(batch if inside.all() else batch.where(inside))
            if times[-1] <= span[-1]:
                return
            self._extract()
            self._number += 1

    def _hold(self, batch: LidarBatch) -> None:
        self._held.append(batch)
        if batch.times[-1] - self._held[0].times[0] >= self._length:
            self._extract()

    def _extract(self) -> None:
        """Make the surfels of what is held."""
        if not self._held:
            return
        held, self._held = self._held, []
        angles = [b.angles for b in held if b.angles is not None]
        surfels = _core.extract_surfels(
            np.ascontiguousarray(np.concatenate([b.points for b in held])),
            np.concatenate([b.times for b in held]),
            np.concatenate(angles) if len(angles) == len(held) else None,
            self._samples[self._number],
            self._slow,
            settings=self._settings,
            range_sigma=self._range_sigma,
            threads=self._threads,
        )
        self._found[self._number].surfels.append(surfels)
