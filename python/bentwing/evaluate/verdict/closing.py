# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the whole recording agrees with itself: loops, and surfaces seen in two visits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.evaluate.verdict.evidence import Evidence

if TYPE_CHECKING:
    from collections.abc import Mapping

    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.revisits import Revisits

# What closing moves is compared with no shorter path, m.
_SHORTEST = 15.0
# A pair of visits as far apart as this, m, is no surprise whatever the sensor.
_OFFSET = 0.01
_FEWEST = 50  # patches that were visited twice


def judge_closing(record: Mapping[str, Any] | None, trajectory: Trajectory) -> list[Evidence]:
    """Judge by how much of what was seen again agrees, and by how far it moved the trajectory.

    Parameters
    ----------
    record : of the closing, as run.json has it; None if it was not asked for
    trajectory : before it
    """
    if not record or not record.get("n_revisits", record.get("n_stretch_pairs")):
        return []
    found = [Evidence("loop", 1.0 - float(record["inlier_share"]))]
    if record.get("applied"):
        moved = float(record["largest_translation"])
        length = max(_length_of(trajectory), _SHORTEST)
        found.append(Evidence("correction", moved / length, (), {"moved": moved}))
    return found


def judge_revisits(found: Revisits | None, sigma: float) -> list[Evidence]:
    """Judge by how far apart two visits have measured the same flat surfaces.

    Parameters
    ----------
    found : on the map; None if nothing was seen twice
    sigma : m, of a range
    """
    if found is None or found.n_patches < _FEWEST:
        return []
    expected = float(np.hypot(sigma, _OFFSET))
    return [Evidence("revisits", found.std / expected, (), {"millimetres": 1e3 * found.median})]


def _length_of(trajectory: Trajectory) -> float:
    """Length of the way, m, from positions half a second apart, so that vibration does not count."""
    steps = trajectory.positions[::50]
    return float(np.linalg.norm(np.diff(steps, axis=0), axis=1).sum())
