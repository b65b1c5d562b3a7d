# SPDX-License-Identifier: MIT OR Apache-2.0
"""An estimator on a simulated recording, beside the truth of the recording."""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing import odometry
from bentwing.base.errors import BentwingError
from bentwing.base.trajectory import read_tum
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.odometry import Estimator, EstimatorName

    Array = NDArray[np.float64]

_SAMPLE = 400_000  # points that are kept of a recording, for pictures
_POINT_RATE = 3e5  # 1/s, of a VLP-16


@dataclass(frozen=True, slots=True)
class Trial:
    """An algorithm: estimator and settings (None: the defaults), by its name in the tables."""

    name: str
    estimator: EstimatorName
    settings: Any = None


@dataclass(frozen=True, slots=True)
class Attempt:
    """What became of a trial.

    Attributes
    ----------
    estimate : None if the estimator gave up
    why : the reason, if so
    engine : the estimator, for what only it knows
    truth : poses of the IMU on the recording's clock
    lidar : some of the returns, evenly chosen
    length : s, of the recording
    seconds, cpu : wall and processor time of the estimate, reading included, s
    """

    estimate: Estimate | None
    why: str
    engine: Estimator
    truth: Trajectory
    lidar: list[LidarBatch]
    length: float
    seconds: float
    cpu: float


def attempt(
    folder: Path, trial: Trial, threads: int, shown: Callable[[float], None] | None = None
) -> Attempt:
    """Run an estimator, open loop, on the recording in a folder that `simulate` has written.

    Parameters
    ----------
    shown : called with the seconds of the recording that are done since the last call
    """
    payload = Payload.load(folder / "payload.yaml")
    engine = odometry.create(trial.estimator, payload, trial.settings, threads)
    kept: list[LidarBatch] = []
    estimate, why, reached = None, "", 0.0
    with Recording(folder / "recording.bag", payload) as recording:
        truth, _ = read_tum(folder / "truth_trajectory.txt", recording.clock.start_ns)
        length = recording.duration
        every = slice(None, None, int(_POINT_RATE * length / _SAMPLE) | 1)
        cpu, began = time.process_time(), time.perf_counter()
        try:
            for batch in preprocess(recording.batches(), payload, Counter()):
                engine.feed(batch)
                if isinstance(batch, LidarBatch):
                    kept.append(batch.where(every))
                    if shown is not None and len(batch.times):
                        shown(float(batch.times[-1]) - reached)
                        reached = float(batch.times[-1])
            estimate = engine.result()
        except BentwingError as error:
            why = str(error)
    if shown is not None:
        shown(length - reached)
    seconds, cpu = time.perf_counter() - began, time.process_time() - cpu
    return Attempt(estimate, why, engine, truth, kept, length, seconds, cpu)


def motor_stopped(lidar: Sequence[LidarBatch]) -> list[LidarBatch]:
    """Give all returns the motor's first angle, as if it stood still; none without a motor."""
    turned = [(b, b.angles) for b in lidar if b.angles is not None and len(b.angles)]
    return [replace(b, angles=np.full(len(b.times), turned[0][1][0])) for b, _ in turned]


@dataclass(frozen=True, slots=True)
class Flight:
    """A simulated flight, and who estimates it.

    Attributes
    ----------
    name : by which its results are found
    scenario : fields of a `Scenario`, without duration and seed
    duration, quick_duration : s
    trials : in the order of the tables
    """

    name: str
    scenario: dict[str, Any]
    duration: float
    quick_duration: float
    trials: tuple[Trial, ...] = field(default=())

    def seconds(self, *, quick: bool) -> float:
        """Length of the recording."""
        return self.quick_duration if quick else self.duration
