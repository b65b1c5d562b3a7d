# SPDX-License-Identifier: MIT OR Apache-2.0
"""Names of time scales and of kinds of solutions."""

from typing import Literal

FixQuality = Literal["fixed", "float", "ppp", "differential", "single"]
TimeScale = Literal["gps", "utc"]
