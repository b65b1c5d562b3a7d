# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether a recording is fit for mapping: what it holds, what it lacks, how to repair that."""

from bentwing.calibrate.inspection.fitness import Judgement, judge
from bentwing.calibrate.inspection.inspect import Inspection, inspect

__all__ = ["Inspection", "Judgement", "inspect", "judge"]
