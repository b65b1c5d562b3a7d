# SPDX-License-Identifier: MIT OR Apache-2.0
"""The set-up of a sensor head, found from a recording: mount, axes, units, clocks and motor."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.calibrate.set_up.find import find_set_up
    from bentwing.calibrate.set_up.set_up import Finding, SetUp
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "calibrate.set_up.find": ["find_set_up"],
            "calibrate.set_up.set_up": ["Finding", "SetUp"],
        },
    )

__all__ = ["Finding", "SetUp", "find_set_up"]
