# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry against keyframes (Tazir 2020)."""

from __future__ import annotations

from bentwing.estimators.ndt.estimator import Ndt
from bentwing.estimators.ndt.settings import NdtSettings

__all__ = ["Ndt", "NdtSettings"]
