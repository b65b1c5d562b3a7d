# SPDX-License-Identifier: MIT OR Apache-2.0
"""The names of the estimators, apart from the estimators so that a help page shows them at once."""

from __future__ import annotations

from typing import Literal, TypeAlias

EstimatorName: TypeAlias = Literal["continuous", "kalman", "ndt"]
