# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators by name, each with the model of its settings."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from bentwing.base.arguments import instance
from bentwing.base.errors import UsageError
from bentwing.odometry.continuous.estimator import Continuous
from bentwing.odometry.continuous.settings import ContinuousSettings
from bentwing.odometry.kalman import Kalman, KalmanSettings
from bentwing.odometry.ndt import Ndt, NdtSettings
from bentwing.recording.payload import as_payload

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic import BaseModel

    from bentwing.odometry.interface import Estimator
    from bentwing.odometry.names import EstimatorName
    from bentwing.recording.payload import PayloadLike

EstimatorSettings: TypeAlias = ContinuousSettings | KalmanSettings | NdtSettings
ESTIMATORS: dict[EstimatorName, tuple[Callable[..., Estimator], type[BaseModel]]] = {
    "continuous": (Continuous, ContinuousSettings),
    "kalman": (Kalman, KalmanSettings),
    "ndt": (Ndt, NdtSettings),
}


def create(
    name: EstimatorName,
    payload: PayloadLike,
    settings: EstimatorSettings | None = None,
    threads: int | None = None,
) -> Estimator:
    """Return an estimator.

    Parameters
    ----------
    name : one of `ESTIMATORS`
    payload : the sensor head, or the payload.yaml that describes it
    settings : of the model that belongs to the name; default: its defaults
    threads : default: all cores

    Raises
    ------
    UsageError
        If there is no estimator of that name.
    TypeError
        If payload or settings are of another type.
    """
    require_settings(name, settings)
    engine, _ = ESTIMATORS[name]
    return engine(as_payload(payload), settings, threads)


def require_settings(name: EstimatorName, settings: EstimatorSettings | None) -> None:
    """Refuse settings that are not those of the estimator; None stands for its defaults."""
    require_estimator(name)
    if settings is not None:
        _, model = ESTIMATORS[name]
        instance("settings", settings, model, f"the estimator {name!r} has settings of its own")


def require_estimator(name: str) -> None:
    """Refuse an estimator that does not exist, before anything is read."""
    if name not in ESTIMATORS:
        *others, last = ESTIMATORS
        msg = f"estimator {name!r} is not known; choose {', '.join(others)} or {last}"
        raise UsageError(msg)
