# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators: batches in, a trajectory with its calibration and health out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.base.errors import UsageError
from bentwing.odometry.continuous.estimator import Continuous
from bentwing.odometry.kalman import Kalman
from bentwing.odometry.ndt import Ndt

if TYPE_CHECKING:
    from bentwing.odometry.interface import Estimator
    from bentwing.recording import Payload

__all__ = [
    "AVAILABLE_ESTIMATORS",
    "ESTIMATORS",
    "Continuous",
    "Kalman",
    "Ndt",
    "create",
    "require_estimator",
]

ESTIMATORS = ("continuous", "kalman", "ndt")
AVAILABLE_ESTIMATORS = ESTIMATORS


def create(
    name: str,
    payload: Payload,
    settings: Any = None,  # noqa: ANN401 - each estimator has its own model
    threads: int | None = None,
) -> Estimator:
    """Return the estimator `name`, or raise UsageError where there is none of that name."""
    require_estimator(name)
    if name == "kalman":
        return Kalman(payload, settings, threads)
    engine = Ndt if name == "ndt" else Continuous
    return engine(payload, settings, threads)


def require_estimator(name: str) -> None:
    """Refuse an estimator that does not exist, before anything is read."""
    if name not in AVAILABLE_ESTIMATORS:
        choice = f"{', '.join(AVAILABLE_ESTIMATORS[:-1])} or {AVAILABLE_ESTIMATORS[-1]}"
        msg = f"estimator {name!r} is not known; choose {choice}"
        raise UsageError(msg)
