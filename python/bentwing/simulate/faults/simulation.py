# SPDX-License-Identifier: MIT OR Apache-2.0
"""A simulated recording with a fault."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from bentwing.simulate.faults.registry import fault_of
from bentwing.simulate.faults.rewrite import with_fault
from bentwing.simulate.simulation import simulate
from bentwing.simulate.write import require_no_recording

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.simulate.scenario import Scenario
    from bentwing.simulate.write import SimulatedRecording


def simulate_with_fault(
    scenario: Scenario, fault: str, out: Path, progress: Callable[[float], None] | None = None
) -> SimulatedRecording:
    """Simulate a recording and write it, with a fault, into the folder `out`.

    Raises
    ------
    UsageError
        As `simulate` and `with_fault` do.
    """
    fault_of(fault, scenario.head)
    require_no_recording(out)
    with TemporaryDirectory() as scratch:
        good = simulate(scenario, Path(scratch), progress)
        recording, payload = with_fault(
            good.recording, good.payload, fault, out, seed=scenario.seed
        )
    return replace(
        good,
        recording=recording,
        payload=payload,
        trajectory=out / good.trajectory.name,
        scene=out / good.scene.name,
        calibration=out / good.calibration.name,
        scenario=out / good.scenario.name,
    )
