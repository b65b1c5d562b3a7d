# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators that can be used live, and what they have done so far."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

from bentwing.base.errors import UsageError
from bentwing.odometry import Continuous, Kalman
from bentwing.odometry.continuous.odometry_pass import OdometryPass
from bentwing.odometry.kalman.filter_pass import FilterPass
from bentwing.odometry.kalman.snapshot import FilterSnapshot

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.recording import Payload

Engine: TypeAlias = Continuous | Kalman
# What a window or a sweep leaves behind, and the run of the estimator that it belongs to.
Done: TypeAlias = OdometryPass | FilterSnapshot
Pass: TypeAlias = OdometryPass | FilterPass


def create_engine(
    name: str,
    payload: Payload,
    settings: Any,  # noqa: ANN401 - each estimator has its own model
    threads: int | None,
) -> Engine:
    """Return the estimator `name`, or raise UsageError where it cannot be used live."""
    if name == "continuous":
        return Continuous(payload, settings, threads)
    if name == "kalman":
        return Kalman(payload, settings, threads)
    msg = f"estimator {name!r} cannot be used live; choose continuous or kalman"
    raise UsageError(msg)


def new_data(engine: Engine) -> float:
    """Return how much new lidar data the engine takes at a time, s."""
    return engine.settings.scan if isinstance(engine, Kalman) else engine.settings.shift


def estimate_at(engine: Engine, done: Done) -> Estimate:
    """Return what an engine has estimated up to something it has left behind."""
    if isinstance(engine, Kalman):
        assert isinstance(done, FilterSnapshot)
        return engine.estimate(done)
    assert isinstance(done, OdometryPass)
    return engine.estimate(done)
