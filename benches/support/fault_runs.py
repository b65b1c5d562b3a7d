# SPDX-License-Identifier: MIT OR Apache-2.0
"""Simulated flights, mapped by the command line as they are, with a fault or without a payload."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

from benches.support.cost import python
from benches.support.fault_outcomes import Told, is_as_good, outcome, told
from bentwing.base.errors import InputError
from bentwing.evaluate.simulated import Truth, WorldError, world_error
from bentwing.simulate import Scenario, simulate
from bentwing.simulate.faults import FAULTS, with_fault
from bentwing.simulate.faults.clocks import CAUSE as CLOCK

NO_PAYLOAD = 1.3
"""Without a payload the path may be so many times as far off as with it."""
EVIDENCE = (
    "warnings", "notes", "counts", "calibration", "loop_closure", "windows", "timings", "verdict",
    "set_up",
)  # fmt: skip


@dataclass(frozen=True)
class Flight:
    """A simulated flight; what it needs lies in its folder.

    Attributes
    ----------
    scenario : what is simulated
    folder : for the recording, made when it is needed first
    words : further options of `bentwing map`
    """

    scenario: Scenario
    folder: Path
    words: tuple[str, ...] = ()

    @cached_property
    def truth(self) -> Truth:
        """Simulate the flight and return its truth."""
        if not (self.folder / "truth_calibration.yaml").exists():
            simulate(self.scenario, self.folder)
        return Truth(self.folder)

    @cached_property
    def good(self) -> Result:
        """Map the recording as it is."""
        return self.mapped(self.truth.folder)

    def mapped(self, folder: Path, *, payload: bool = True, fault: str | None = None) -> Result:
        """Map the recording in a folder, with its payload or without."""
        with TemporaryDirectory(dir=self.folder) as scratch:
            run, said = Path(scratch) / "run", Path(scratch) / "said.txt"
            described = ["--payload", folder / "payload.yaml"] if payload else []
            words = [
                "map",
                folder / "recording.bag",
                *described,
                "-o",
                run,
                "--quiet",
                "--no-refine",
                *self.words,
            ]
            finished = python("-m", "bentwing", *words, output=said)
            record = _record(run)
            error = _error(self.truth, run, fault) if finished.code in (0, 4) else None
            text = said.read_text(encoding="utf-8")
        return Result(finished.code, finished.cost.seconds, text, record, error)

    def with_fault(self, fault: str, *, payload: bool = True) -> Result:
        """Put a fault into the recording and map it."""
        source, target = self.truth.folder, self.folder / f"with-{fault}"
        shutil.rmtree(target, ignore_errors=True)
        bag, described = source / "recording.bag", source / "payload.yaml"
        with_fault(bag, described, fault, target, seed=self.scenario.seed)
        result = self.mapped(target, payload=payload, fault=fault)
        shutil.rmtree(target)
        return result


@dataclass(frozen=True)
class Result:
    """What mapping left; no error where there is no map to compare."""

    code: int
    seconds: float
    said: str
    record: dict | None
    error: WorldError | None

    @property
    def told(self) -> Told:
        """What it told its user."""
        return told(self.code, self.record, self.said)


def row_of(flight: Flight, result: Result, fault: str | None, *, payload: bool = True) -> dict:
    """A run with its outcome and all evidence, as plain JSON types."""
    scenario, said, good = flight.scenario, result.told, flight.good.error
    row = {
        "scene": scenario.scene,
        "head": scenario.head,
        "seed": scenario.seed,
        "events": list(scenario.events),
        "spin": scenario.spin,
        "duration": scenario.duration,
        "fault": fault,
        "repair": None if fault is None else FAULTS[fault].repair,
        "payload": "given" if payload else "none",
        "code": result.code,
        "seconds": result.seconds,
        "said": result.said,
        "state": said.state,
        "sentences": said.sentences,
        "repairs": said.repairs,
        "error": None if result.error is None else asdict(result.error),
        "good": None if good is None else asdict(good),
        "outcome": None,
        **{name: (result.record or {}).get(name) for name in EVIDENCE},
    }
    if good is not None and fault is not None:
        row["outcome"] = outcome(said, result.error, good, FAULTS[fault].cause)
    elif good is not None and not payload:
        is_good = result.error is not None and is_as_good(result.error, good, NO_PAYLOAD)
        row["outcome"] = "right" if is_good else said.state
    return row


def _record(run: Path) -> dict | None:
    path = run / "run.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def _error(truth: Truth, run: Path, fault: str | None) -> WorldError | None:
    """Compare a run with the truth; None where it ended before there was a map."""
    if not (run / "map.laz").exists():
        return None
    moves_clock = fault is not None and FAULTS[fault].cause == CLOCK
    try:
        return world_error(truth, run, any_clock=moves_clock)
    except InputError:
        return None
