# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a recording is fit for mapping: what it holds, what it lacks, how to repair that."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.calibrate.inspection.fitness import Judgement, judge
    from bentwing.calibrate.inspection.look import Inspection, inspect
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "calibrate.inspection.fitness": ["Judgement", "judge"],
            "calibrate.inspection.look": ["Inspection", "inspect"],
        },
    )

__all__ = ["Inspection", "Judgement", "inspect", "judge"]
