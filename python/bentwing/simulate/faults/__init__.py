# SPDX-License-Identifier: MIT OR Apache-2.0
"""Faults: what a sensor head writes that is wrongly set up, and what its payload.yaml says wrongly."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.simulate.faults.fault import Fault
    from bentwing.simulate.faults.registry import FAULTS, fault_of
    from bentwing.simulate.faults.rewrite import with_fault
    from bentwing.simulate.faults.simulation import simulate_with_fault
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "simulate.faults.fault": ["Fault"],
            "simulate.faults.registry": ["FAULTS", "fault_of"],
            "simulate.faults.rewrite": ["with_fault"],
            "simulate.faults.simulation": ["simulate_with_fault"],
        },
    )

__all__ = [
    "FAULTS",
    "Fault",
    "fault_of",
    "simulate_with_fault",
    "with_fault",
]
