# SPDX-License-Identifier: MIT OR Apache-2.0
"""Recordings with truth: simulated worlds, flights, sensor heads and their errors.

A simulation ends in a recording and enters the pipeline by the front door, like any other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.simulation import simulate
    from bentwing.simulate.write import SimulatedRecording
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "simulate.scenario": ["Scenario"],
            "simulate.simulation": ["simulate"],
            "simulate.write": ["SimulatedRecording"],
        },
    )

__all__ = [
    "Scenario",
    "SimulatedRecording",
    "simulate",
]
