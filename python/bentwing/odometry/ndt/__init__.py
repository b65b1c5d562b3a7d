# SPDX-License-Identifier: MIT OR Apache-2.0
"""NDT odometry against keyframes (Tazir 2020)."""

from __future__ import annotations

from bentwing.odometry.ndt.estimator import Ndt
from bentwing.odometry.ndt.settings import NdtSettings

__all__ = ["Ndt", "NdtSettings"]
