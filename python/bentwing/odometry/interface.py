# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator takes and returns, in a recording and live."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from bentwing.odometry.buffer import BatchBuffer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy as np
    from numpy.typing import NDArray
    from pydantic import BaseModel

    from bentwing import _core
    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.recording.batches import Batch


class Registered(Protocol):
    """What a pass, a stretch of the recording without a break, has registered."""

    @property
    def end(self) -> float:
        """Stamp up to which lidar data was used, s."""

    @property
    def windows(self) -> Sequence[WindowRecord]:
        """Records of the windows, sweeps or scans, at least one."""

    @property
    def is_settling(self) -> bool:
        """Whether what a pass learns at its beginning may still move its poses."""

    @property
    def samples(self) -> _core.Samples:
        """The recent poses, to place points by; `level` turns what they place."""

    @property
    def globals(self) -> _core.Globals:
        """The slow states, in the map of `samples`."""

    def recent(self) -> Trajectory:
        """Return the recent poses, level."""

    def level(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn points (N, 3), m, that `samples` has placed so that gravity is vertical."""

    def normals(self) -> NDArray[np.float64]:
        """Return the normals (N, 3), level, of the surfaces in the last window, where they are known."""


@dataclass(frozen=True, slots=True)
class Snapshot:
    """What is known after a step; it stays so while the estimator goes on in another thread.

    Attributes
    ----------
    registered : what the pass under way has registered
    n_passes : how many have begun: points placed by another pass belong to another map
    estimate : returns what all passes say
    """

    registered: Registered
    n_passes: int
    estimate: Callable[[], Estimate]


class Estimator(ABC):
    """Feed batches in time order, then ask for the result.

    `feed` does at once what has become possible. Whoever has no time to wait for it lets the estimator
    `take` the batches, and makes it `advance` elsewhere, step by step; the result is the same.

    Attributes
    ----------
    settings : model of the estimator
    buffer : what coming steps may need of the batches
    """

    settings: BaseModel

    def __init__(self) -> None:
        self.buffer = BatchBuffer()

    def feed(self, batch: Batch) -> None:
        """Take the next batch; work that has become possible is done before it returns."""
        self.take(batch)
        while self.advance():
            pass

    def result(self) -> Estimate:
        """Finish with what was fed so far.

        Raises
        ------
        EstimationError
            If it is not enough.
        """
        while self.advance(finishing=True):
            pass
        return self.so_far()

    def take(self, batch: Batch) -> None:
        """Hold the next batch for `advance`."""
        self.buffer.add(batch)

    @property
    @abstractmethod
    def step_length(self) -> float:
        """How much new lidar data a step takes at most, s."""

    @abstractmethod
    def advance(self, *, finishing: bool = False) -> bool:
        """Do one step that has become possible; returns whether there was one.

        Parameters
        ----------
        finishing : no more batches will come, so that a step may take less than usual
        """

    @property
    @abstractmethod
    def current(self) -> Snapshot | None:
        """What the pass under way knows now; None until it has registered something."""

    @abstractmethod
    def so_far(self) -> Estimate:
        """Return what is estimated already, without any further work.

        Raises
        ------
        NotEnoughDataError
            If nothing is.
        """
