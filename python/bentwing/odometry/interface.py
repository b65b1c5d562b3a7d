# SPDX-License-Identifier: MIT OR Apache-2.0
"""What every estimator takes and returns."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from bentwing.base.estimate import Estimate
    from bentwing.recording.batches import Batch


class Estimator(Protocol):
    """Feed batches in time order, then ask for the result."""

    def feed(self, batch: Batch) -> None:
        """Take the next batch; work that has become possible is done before it returns."""

    def result(self) -> Estimate:
        """Finish with what was fed so far."""

    def so_far(self) -> Estimate:
        """Return what is estimated already, without any further work."""
