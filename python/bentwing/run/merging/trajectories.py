# SPDX-License-Identifier: MIT OR Apache-2.0
"""The trajectories of runs in one map: a file each, and what run.json says about them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.base.regular_file import resolved
from bentwing.base.transform import rigid

if TYPE_CHECKING:
    from collections.abc import Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.run.folder import RunFolder
    from bentwing.run.merging.source import Source


def write_trajectories(
    folder: RunFolder,
    sources: Sequence[Source],
    placed: Sequence[Estimate],
    estimates: Sequence[Estimate],
) -> tuple[dict[str, Any], ...]:
    """Write a trajectory for each run; return what run.json says about the runs.

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
                "folder": resolved(source.folder),
                "recordings": source.recordings,
                "head": {"name": source.payload.name, "kind": source.payload.lidar.kind},
                "start_ns": source.start_ns,
                "trajectory": name,
                "T_map_run": _rigid(source.estimate, estimate),
                "T_map_run_by_places": _rigid(source.estimate, before),
                "segments": estimate.segments,
                "calibration": estimate.calibration,
            }
        )
    return tuple(described)


def _rigid(before: Estimate, after: Estimate) -> list[list[float]]:
    """Return the transform (4, 4) that leads from one trajectory to the other, as well as one can."""
    old, new = before.trajectory.within(before.segments), after.trajectory
    positions, quats = new.interpolate(np.clip(old.times, new.times[0], new.times[-1]))
    turns = geometry.multiply(quats, geometry.inverse(old.quats_xyzw))
    R = geometry.to_matrices(geometry.mean_rotation(turns))
    shift = positions.mean(axis=0) - R @ old.positions.mean(axis=0)
    T: list[list[float]] = rigid(R, shift).tolist()
    return T
