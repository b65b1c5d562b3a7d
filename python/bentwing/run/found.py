# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the stages of a run have found, as values; each knows its part of run.json."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from bentwing.evaluate.verdict import Verdict, judge_breaks, verdict_of
from bentwing.map.sample import MapSample
from bentwing.recording import ImuBatch
from bentwing.recording.preprocess.imu_limits import limit_sentences

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.base.estimate import Estimate
    from bentwing.calibrate.set_up import SetUp
    from bentwing.closing.beams import FoundBeams
    from bentwing.closing.georeference.georeference import Georeferenced
    from bentwing.closing.localize import GivenCoordinates
    from bentwing.evaluate.expected import ExpectedAccuracy
    from bentwing.evaluate.revisits import Revisits
    from bentwing.evaluate.verdict import Evidence, Reason
    from bentwing.map.change import Change
    from bentwing.recording import Batch, Payload

    Placed: TypeAlias = Georeferenced | GivenCoordinates
    Record: TypeAlias = Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class Reading:
    """What the first pass over a recording has read and dropped.

    Attributes
    ----------
    clocks : by sensor, what its stamps say of its clock, for run.json
    """

    counts: dict[str, int] = field(default_factory=dict)
    warnings: list[str] = field(default_factory=list)
    clocks: dict[str, dict[str, Any]] = field(default_factory=dict)


@dataclass(slots=True)
class Spin:
    """Rate of turn of the IMU, about ten values a second.

    Attributes
    ----------
    samples : time, s, and rate, rad/s
    """

    samples: list[tuple[float, float]] = field(default_factory=list)

    def watch(self, batch: Batch) -> None:
        """Note the rate of turn of an IMU batch."""
        if isinstance(batch, ImuBatch) and len(batch.times):
            rate = float(np.median(np.linalg.norm(batch.gyro, axis=1)))
            # both at once: an interrupt may come between any two statements
            self.samples.append((float(batch.times.mean()), rate))

    @property
    def series(self) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Times (N,) s and rates (N,) rad/s; None without an IMU."""
        times, rates = np.array(self.samples).reshape(-1, 2).T
        return (times, rates) if len(times) else None


@dataclass(frozen=True, slots=True)
class WrittenMap:
    """A map that was written.

    Attributes
    ----------
    path : its file
    counts : points that were projected, left out and written
    record : how it was cleaned, for run.json
    sample : evenly chosen points, in the frame of the trajectory
    revisits : how well they agree that were seen twice, if any were
    change : what has appeared and disappeared since the prior map
    compared : what run.json says of that
    """

    path: Path
    counts: dict[str, int]
    record: dict[str, Any]
    sample: MapSample
    revisits: Revisits | None = None
    change: Change | None = None
    compared: Record = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Found:
    """What the stages of a run have found so far; each returns it with one thing more.

    Attributes
    ----------
    estimate : trajectory, calibration and diagnostics; None before there are any
    reading : what was read
    spin : how the IMU turned
    localization, loop_closure, merging : what was done to correct the trajectory, for run.json
    placed : where the map is on the Earth, or in the coordinates of a prior map
    map : the map
    accuracy : what to expect of trajectory and map
    runs : of a merged map, the runs in it, for run.json
    stage_warnings : sentences of the stages behind the estimate
    evidence : by which the result is judged
    judged : of a merged map, what speaks against the runs in it
    set_up : the head as the recording shows it, where that is other than the payload says
    beams : by how much the lidar's beams are off, where that was found; it is taken out
    payload : by which the recording was read in the end, what was found of the head included
    doubt : why the estimate was stopped before its end
    failure : why the last stage did not finish
    """

    estimate: Estimate | None = None
    reading: Reading = Reading()
    spin: Spin = field(default_factory=Spin)
    localization: Record | None = None
    loop_closure: Record | None = None
    merging: Record | None = None
    placed: Placed | None = None
    map: WrittenMap | None = None
    accuracy: ExpectedAccuracy | None = None
    runs: tuple[Record, ...] = ()
    stage_warnings: tuple[str, ...] = ()
    evidence: tuple[Evidence, ...] = ()
    judged: tuple[Reason, ...] = ()
    set_up: SetUp | None = None
    beams: FoundBeams | None = None
    payload: Payload | None = None
    doubt: Verdict | None = None
    failure: BaseException | None = None

    @property
    def sample(self) -> MapSample:
        """Evenly chosen points of the map; none before there is one."""
        return MapSample() if self.map is None else self.map.sample

    @property
    def verdict(self) -> Verdict:
        """Whether the result can be used, by what is known so far."""
        breaks = [] if self.estimate is None else judge_breaks(self.estimate.breaks)
        return verdict_of([*self.evidence, *breaks], self.judged)

    @property
    def warnings(self) -> list[str]:
        """Sentences about the health of the result, each once."""
        estimated = [] if self.estimate is None else self.estimate.warnings
        return list(dict.fromkeys([*self.reading.warnings, *estimated, *self.stage_warnings]))

    @property
    def timings(self) -> dict[str, float]:
        """Seconds of wall time by stage of the estimate."""
        timings = {} if self.estimate is None else self.estimate.timings
        return {f"estimate/{stage}": seconds for stage, seconds in timings.items()}

    def to_json(self) -> dict[str, Any]:
        """Return what run.json says about the result."""
        estimate, written = self.estimate, self.map
        counts = {**self.reading.counts}
        if estimate is not None:
            counts.update(estimate.counts)
        if written is not None:
            counts.update(written.counts)
        localization = self.localization
        if localization is not None and written is not None:
            localization = {**localization, **written.compared}
        return {
            "counts": counts,
            "clocks": self.reading.clocks,
            # Of a recording that was refused nothing is there that could be good.
            "verdict": None if estimate is None and written is None else self.verdict,
            "beams": self.beams,
            "set_up": [] if self.set_up is None else self.set_up.findings,
            "warnings": self.warnings,
            "notes": [*limit_sentences(counts), *([] if estimate is None else estimate.notes)],
            "calibration": None if estimate is None else estimate.calibration,
            "localization": localization,
            "loop_closure": self.loop_closure,
            "expected_accuracy": self.accuracy,
            "georeference": None if self.placed is None else self.placed.record,
            "map": {} if written is None else written.record,
            "merging": self.merging,
            "segments": [] if estimate is None else estimate.segments,
            "windows": [] if estimate is None else estimate.windows,
            **({"runs": self.runs} if self.runs else {}),
        }
