# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a recording says of its own set-up: whether it is fit, and the calibration of the head."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.calibrate.head import calibrate
    from bentwing.calibrate.inspection.look import Inspection, inspect
    from bentwing.calibrate.outcome import Calibrated
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "calibrate.head": ["calibrate"],
            "calibrate.inspection.look": ["Inspection", "inspect"],
            "calibrate.outcome": ["Calibrated"],
        },
    )

__all__ = [
    "Calibrated",
    "Inspection",
    "calibrate",
    "inspect",
]
