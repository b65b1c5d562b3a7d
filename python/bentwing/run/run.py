# SPDX-License-Identifier: MIT OR Apache-2.0
"""A finished run as a value."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bentwing.base.calibration import Calibration
from bentwing.base.covariances import PoseCovariances
from bentwing.base.errors import InputError, UsageError
from bentwing.base.estimate import Estimate
from bentwing.base.run_record import finished_record, understood
from bentwing.base.trajectory import DT, read_tum
from bentwing.base.window_record import WindowRecord
from bentwing.evaluate.verdict import Verdict, verdict_of
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.base.trajectory import Trajectory
    from bentwing.run.found import Found

COVARIANCES = "trajectory_covariance.txt"
_ROUNDED = 1e-6  # s; stamps in files are rounded to the nanosecond


@dataclass(frozen=True, slots=True)
class Run:
    """A finished run.

    Attributes
    ----------
    out : the run folder
    estimate : trajectory, calibration and diagnostics
    verdict : whether the result can be used, and why not
    warnings : sentences about the health of the result
    map_path : the map; None where none was asked for
    report_path : the report
    """

    out: Path
    estimate: Estimate
    verdict: Verdict
    warnings: tuple[str, ...]
    map_path: Path | None
    report_path: Path

    @property
    def trajectory(self) -> Trajectory:
        """Poses of the IMU in the map."""
        return self.estimate.trajectory

    @property
    def covariances(self) -> PoseCovariances | None:
        """Of the poses; None where the estimator has none."""
        return self.estimate.covariances

    @classmethod
    def of(cls, out: Path, found: Found) -> Run:
        """Return the run whose stages have found this."""
        if found.estimate is None:
            msg = "found: expected the result of all stages, got one without estimate"
            raise ValueError(msg)
        return cls(
            out,
            found.estimate,
            found.verdict,
            tuple(found.warnings),
            None if found.map is None else found.map.path,
            out / "report.html",
        )

    @classmethod
    def load(cls, out: Path | str) -> Run:
        """Read a finished run back from its folder.

        Stamps and poses are rounded as in trajectory.txt.

        Raises
        ------
        UsageError
            If the folder holds no run, a merged map, or a run that is not complete.
        InputError
            If its trajectory cannot be read.
        """
        folder = Path(out)
        record = require_single(folder, finished_record(folder))
        with understood(folder):
            maps = [folder / name for name in record["files"] if name.startswith("map.")]
            return cls(
                folder,
                estimate_of(folder, record),
                verdict_in(record),
                tuple(record["warnings"]),
                maps[0] if maps else None,
                folder / "report.html",
            )


def require_single(folder: Path, record: dict[str, Any]) -> dict[str, Any]:
    """Return the record of a run that is no merged one, or raise UsageError."""
    if record.get("runs"):
        of = ", ".join(str(run.get("folder")) for run in record["runs"])
        msg = f"{folder}: holds a merged map; give the runs that it was made of ({of}) instead"
        raise UsageError(msg)
    return record


def verdict_in(record: Mapping[str, Any]) -> Verdict:
    """Return the verdict in a record; runs of earlier versions have none, and nothing speaks against them."""
    described = record.get("verdict")
    return Verdict.from_json(described) if described else verdict_of([])


def estimate_of(
    folder: Path, record: Mapping[str, Any], trajectory: str = "trajectory.txt"
) -> Estimate:
    """Return the estimate of a complete run from its folder and record.

    Parameters
    ----------
    record : of the run, or of one of the runs in a merged map
    trajectory : name of its file
    """
    poses, _ = read_tum(folder / trajectory, int(record["start_ns"]))
    spans = record.get("segments") or [[float(poses.times[0]), float(poses.times[-1])]]
    cut = [poses.within([(a - _ROUNDED, b + _ROUNDED)]) for a, b in spans]
    segments = [part for part in cut if len(part.times) > 1]
    if not segments:
        msg = f"{folder / trajectory}: does not cover the segments in run.json; map it again"
        raise InputError(msg)
    return Estimate(
        joined(segments, DT),
        Calibration.from_json(record["calibration"]),
        windows=[WindowRecord.from_json(window) for window in record.get("windows") or []],
        segments=[(float(part.times[0]), float(part.times[-1])) for part in segments],
        covariances=_covariances_of(folder / COVARIANCES, int(record["start_ns"])),
    )


def _covariances_of(path: Path, start_ns: int) -> PoseCovariances | None:
    return PoseCovariances.read(path, start_ns) if path.exists() else None
