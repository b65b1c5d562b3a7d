# SPDX-License-Identifier: MIT OR Apache-2.0
"""Global non-rigid registration: a recording corrected by everything it saw more than once."""

from __future__ import annotations

from bentwing.global_registration.budget import Budget
from bentwing.global_registration.closing import Closed, close_loops
from bentwing.global_registration.fixed import STAMP
from bentwing.global_registration.settings import GlobalSettings

__all__ = ["STAMP", "Budget", "Closed", "GlobalSettings", "close_loops"]
