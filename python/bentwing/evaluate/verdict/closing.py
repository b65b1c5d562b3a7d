# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the whole recording agrees with itself and with what was surveyed: loops, visits, marks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.evaluate.verdict.evidence import Evidence
from bentwing.evaluate.verdict.usual import usual_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.evaluate.revisits import Revisits

# What closing moves is compared with no shorter path, m.
_SHORTEST = 15.0
# A pair of visits as far apart as this, m, is no surprise whatever the sensor.
_OFFSET = 0.01
_NAMED = 3  # pairs of runs, of many
_FEWEST = 50  # patches that were visited twice


def judge_closing(
    record: Mapping[str, Any] | None, estimates: Sequence[Estimate]
) -> list[Evidence]:
    """Judge by how much of what was seen again agrees, and by how far it moved the trajectory.

    Parameters
    ----------
    record : of the closing, as run.json has it; None if it was not asked for
    estimates : before it
    """
    if not record or not record.get("n_revisits", record.get("n_stretch_pairs")):
        return []
    found = [Evidence("loop", 1.0 - float(record["inlier_share"]))]
    if record.get("applied"):
        moved = float(record["largest_translation"])
        usual = max(_usual_drift(estimate) for estimate in estimates)
        found.append(Evidence("correction", moved / usual, (), {"moved": moved}))
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


def judge_marks(georeference: Mapping[str, Any] | None) -> list[Evidence]:
    """Judge by the surveyed marks that contradict the others.

    Parameters
    ----------
    georeference : as run.json has it; None without any
    """
    found = []
    for one in (georeference or {}).get("contradictions") or []:
        unused = "" if one["used"] else ", and is not used"
        names = " or ".join(one["marks"])
        facts = {"names": names, "metres": one["off"], "unused": unused}
        found.append(Evidence("marks", 1.0, (), facts))
    return found


def judge_joins(pairs: Sequence[tuple[str, str]]) -> list[Evidence]:
    """Judge by runs that a single place joins.

    Parameters
    ----------
    pairs : names of two runs each, whose relative pose rests on one place that nothing confirms
    """
    if not pairs:
        return []
    named = "; ".join(f"{b} and {a}" for a, b in pairs[:_NAMED])
    more = f"; and {len(pairs) - _NAMED} more pairs" if len(pairs) > _NAMED else ""
    return [Evidence("joins", float(len(pairs)), (), {"runs": f"{named}{more}"})]


def _usual_drift(estimate: Estimate) -> float:
    """How far an open-loop trajectory usually drifts, m."""
    # Half a second apart, so that vibration does not count.
    steps = np.diff(estimate.trajectory.positions[::50], axis=0)
    length = float(np.linalg.norm(steps, axis=1).sum())
    return usual_of(estimate.windows).drift * max(length, _SHORTEST)
