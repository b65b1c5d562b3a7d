# SPDX-License-Identifier: MIT OR Apache-2.0
"""The estimators: batches in, a trajectory with its calibration and health out."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.errors import UsageError
from bentwing.estimators.continuous import Continuous

if TYPE_CHECKING:
    from bentwing.estimators.interface import Estimator
    from bentwing.recording import Payload

__all__ = ["Continuous", "create"]


def create(
    name: str,
    payload: Payload,
    settings: Any = None,  # noqa: ANN401 - each estimator has its own model
    threads: int | None = None,
) -> Estimator:
    """Return the estimator `name`, or raise UsageError where there is none of that name."""
    if name == "continuous":
        return Continuous(payload, settings, threads)
    msg = f"estimator {name!r} is not known; choose continuous"
    raise UsageError(msg)
