# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs in one map on the disk: their trajectories, and all their points in one cloud."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.clock import NS_PER_S
from bentwing.base.plain import plain
from bentwing.base.trajectory import Trajectory
from bentwing.map.clean import CleanSettings, clean
from bentwing.map.project import project
from bentwing.map.thin import thin
from bentwing.map.writer import open_map
from bentwing.recording import Recording
from bentwing.recording.preprocess import RecordingPart

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.base.progress import Progress
    from bentwing.map.chunk import MapChunk
    from bentwing.run.folder import RunFolder
    from bentwing.run.merging.source import Source
    from bentwing.run.run import Run

_PAUSE = 10.0  # s between runs that are shown one after the other


@dataclass(frozen=True, slots=True)
class MapOptions:
    """How a map is written; see `bentwing.map_recording`."""

    map_format: str
    map_spacing: float
    threads: int | None
    cleaning: CleanSettings


def write_trajectories(
    folder: RunFolder,
    sources: Sequence[Source],
    placed: Sequence[Estimate],
    estimates: Sequence[Estimate],
) -> None:
    """Write a trajectory for each run, and say in the record what belongs together.

    Parameters
    ----------
    placed : where the places have put the runs
    estimates : where the registration has
    """
    described = []
    for source, before, estimate in zip(sources, placed, estimates, strict=True):
        name = f"trajectory_{source.name}.txt"
        folder.write_trajectory(name, estimate, source.start_ns)
        described.append(
            {
                "name": source.name,
                "folder": str(source.folder.resolve()),
                "recordings": [str(path) for path in source.recordings],
                "start_ns": source.start_ns,
                "trajectory": name,
                "T_map_run": _rigid(source.estimate, estimate),
                "T_map_run_by_places": _rigid(source.estimate, before),
                "segments": plain(estimate.segments),
                "calibration": plain(estimate.calibration),
            }
        )
    folder.record["runs"] = described


def _rigid(before: Estimate, after: Estimate) -> list[list[float]]:
    """Return the transform (4, 4) that leads from one trajectory to the other, as well as one can."""
    old, new = before.trajectory.within(before.segments), after.trajectory
    positions, quats = new.interpolate(np.clip(old.times, new.times[0], new.times[-1]))
    turns = geometry.multiply(quats, geometry.inverse(old.quats_xyzw))
    R = geometry.to_matrices(geometry.mean_rotation(turns))
    T = np.eye(4)
    T[:3, :3] = R
    T[:3, 3] = positions.mean(axis=0) - R @ old.positions.mean(axis=0)
    return T.tolist()


def write_map(
    folder: RunFolder,
    sources: Sequence[Source],
    run: Run,
    estimates: Sequence[Estimate],
    *,
    options: MapOptions,
    watch: Progress,
) -> None:
    """Write the cleaned points of all runs into one map.

    In the file points have the times of their recordings. Where they are cleaned, in the sample for the
    report, and in the trajectory of `run`, the runs follow each other.
    """
    origin_ns = min(source.start_ns for source in sources)
    offsets = _offsets(estimates)
    starts = [(source.start_ns - origin_ns) / NS_PER_S for source in sources]
    late = np.subtract(starts, offsets)
    counts = folder.record["counts"]
    total: Counter[str] = Counter()

    def placed() -> Iterator[MapChunk]:
        for number, (source, estimate, offset) in enumerate(
            zip(sources, estimates, offsets, strict=True)
        ):
            own: dict[str, int] = {}
            for chunk in _placed(source, estimate, own, options.threads, watch):
                run_id = np.full(len(chunk), number, np.uint16)
                yield replace(chunk, times=chunk.times + offset, run_id=run_id)
            total.update(own)

    path = folder.file(f"map.{options.map_format}")
    chunks = clean(
        placed(),
        path,
        duration=offsets[-1] + float(estimates[-1].trajectory.times[-1]),
        settings=options.cleaning,
        counts=counts,
        record=folder.record["map"],
        threads=options.threads,
    )
    chunks = thin(chunks, options.map_spacing, counts)
    with open_map(path, options.map_format, origin_ns) as writer:
        for chunk in run.sample.watch(chunks):
            writer.write(replace(chunk, times=chunk.times + late[chunk.run_id]))
    counts.update(total)
    counts["map.written"] = writer.n_points


def one_after_the_other(estimates: Sequence[Estimate]) -> Trajectory:
    """Return the trajectories of all runs as if they had followed each other."""
    parts = [
        (e.trajectory.within(e.segments), offset)
        for e, offset in zip(estimates, _offsets(estimates), strict=True)
    ]
    return Trajectory(
        np.concatenate([t.times + offset for t, offset in parts]),
        np.concatenate([t.positions for t, _ in parts]),
        np.concatenate([t.quats_xyzw for t, _ in parts]),
    )


def _offsets(estimates: Sequence[Estimate]) -> list[float]:
    """Seconds to add to the times of each run so that they follow each other."""
    offsets: list[float] = []
    end = 0.0
    for estimate in estimates:
        times = estimate.trajectory.times
        offsets.append(end - float(times[0]) if offsets else 0.0)
        end = offsets[-1] + float(times[-1]) + _PAUSE
    return offsets


def _placed(
    source: Source,
    estimate: Estimate,
    counts: dict[str, int],
    threads: int | None,
    watch: Progress,
) -> Iterator[MapChunk]:
    with Recording(source.recordings, source.payload) as recording:
        part = RecordingPart(recording, source.payload, source.start, source.duration)
        with watch.stage(f"map {source.name}", part.length) as shown:
            yield from project(
                part.batches(shown, Counter()),
                estimate.trajectory,
                estimate.calibration,
                segments=estimate.segments,
                threads=threads,
                counts=counts,
            )


def as_settings(options: MapOptions) -> dict[str, Any]:
    """Return the options as run.json has them."""
    described: dict[str, Any] = plain(options)
    return described
