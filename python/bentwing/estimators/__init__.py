# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators: batches in, a trajectory with its calibration and health out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.errors import UsageError
from bentwing.estimators.continuous import Continuous
from bentwing.estimators.ndt import Ndt

if TYPE_CHECKING:
    from bentwing.estimators.interface import Estimator
    from bentwing.recording import Payload

__all__ = ["AVAILABLE_ESTIMATORS", "ESTIMATORS", "Continuous", "Ndt", "create", "require_estimator"]

ESTIMATORS = ("continuous", "kalman", "ndt")
AVAILABLE_ESTIMATORS = ("continuous", "ndt")


def create(
    name: str,
    payload: Payload,
    settings: Any = None,  # noqa: ANN401 - each estimator has its own model
    threads: int | None = None,
) -> Estimator:
    """Return the estimator `name`, or raise UsageError where there is none of that name."""
    require_estimator(name)
    engine = Ndt if name == "ndt" else Continuous
    return engine(payload, settings, threads)


def require_estimator(name: str) -> None:
    """Refuse an estimator that does not exist, before anything is read."""
    choice = " or ".join(AVAILABLE_ESTIMATORS)
    if name not in ESTIMATORS:
        msg = f"estimator {name!r} is not known; choose {choice}"
        raise UsageError(msg)
    if name not in AVAILABLE_ESTIMATORS:
        msg = f"the estimator {name!r} is not in this version; use {choice}"
        raise UsageError(msg)
