# SPDX-License-Identifier: MIT OR Apache-2.0
"""Global non-rigid registration: a recording corrected by everything it saw more than once."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.global_registration.budget import Budget
    from bentwing.closing.global_registration.closing import (
        Closed,
        Recorded,
        Registered,
        close_loops,
        register_jointly,
    )
    from bentwing.closing.global_registration.fixed import STAMP
    from bentwing.closing.global_registration.settings import GlobalSettings
    from bentwing.closing.global_registration.stretches import Collector, Stretches
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "closing.global_registration.budget": ["Budget"],
            "closing.global_registration.closing": [
                "Closed",
                "Recorded",
                "Registered",
                "close_loops",
                "register_jointly",
            ],
            "closing.global_registration.fixed": ["STAMP"],
            "closing.global_registration.settings": ["GlobalSettings"],
            "closing.global_registration.stretches": ["Collector", "Stretches"],
        },
    )

__all__ = [
    "STAMP",
    "Budget",
    "Closed",
    "Collector",
    "GlobalSettings",
    "Recorded",
    "Registered",
    "Stretches",
    "close_loops",
    "register_jointly",
]
