# SPDX-License-Identifier: MIT OR Apache-2.0
"""The segments of one recording, between which it was cut, put together again by what they saw."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from bentwing.base.trajectory import DT
from bentwing.closing.global_registration import Budget, Closed, GlobalSettings, register_jointly
from bentwing.closing.global_registration.stretches import Stretches, length_of, segments_of
from bentwing.closing.joining.describe import describe_matches, describe_parts_of
from bentwing.closing.joining.matches import Match, Part, connected, find_matches, parts_of
from bentwing.closing.joining.named_loops import denied_by, judge_loops, outcomes, without_denied
from bentwing.closing.joining.placing import place_groups
from bentwing.closing.joining.survey import survey
from bentwing.odometry.segments import joined

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from bentwing.base.breaks import Break
    from bentwing.base.estimate import Estimate
    from bentwing.closing.loop_file import NamedLoop
    from bentwing.recording import Batch, Payload

NAME = "recording"


def close_segments(
    estimate: Estimate,
    batches: Iterable[Batch],
    payload: Payload,
    *,
    settings: GlobalSettings | None = None,
    budget: Budget | None = None,
    loops: Sequence[NamedLoop] = (),
    threads: int | None = None,
) -> tuple[Closed, dict[str, Any]]:
    """Find the segments of an estimate in each other, and correct all of them as one.

    Loops that a user names link places of one segment, too.

    A segment that shares no place with the others stays where the estimate has guessed it.

    Parameters
    ----------
    estimate : with more than one segment, or with loops
    batches : of the recording, as the estimator got them
    settings : of the registration; default: its defaults
    budget : what may be held
    loops : that a user has named

    Returns
    -------
    closed : the estimate, and what its registration did; its record says what became of the loops
    record : which places were compared, for run.json

    Raises
    ------
    EstimationError
        If the segments' pose graph cannot be solved.
    """
    settings = settings or GlobalSettings()
    budget = budget or Budget.of(length_of(estimate), settings)
    found = survey(
        NAME,
        estimate,
        batches,
        payload,
        surfel_rate=budget.rate,
        settings=settings,
        threads=threads,
    )
    parts = parts_of([found])
    trajectories = {
        Part(0, s): stretches.trajectory for s, stretches in enumerate(found.recorded.segments)
    }
    named = judge_loops(loops, trajectories, parts)
    links = [n.match for n in named if n.is_used and n.match is not None]
    seen = without_denied(find_matches(parts), named)
    groups, matches = place_groups(trajectories, parts, [*seen, *links])
    placed = {part: t for group in groups for part, t in group.trajectories.items()}
    segments = [
        Stretches(placed[Part(0, s)], stretches.surfels)
        for s, stretches in enumerate(found.recorded.segments)
    ]
    together = connected(parts, matches)
    moved = replace(
        estimate,
        trajectory=joined([s.trajectory for s in segments], DT),
        breaks=_judged(estimate.breaks, together, matches),
    )
    recorded = replace(found.recorded, estimate=moved, segments=segments)
    result = register_jointly([recorded], settings=settings, budget=budget, threads=threads)
    (closed,), warnings = result.estimates, list[str]()
    if result.failure is not None:
        what = "the segments were not registered with each other"
        if len(segments) == 1:
            what = (
                "nothing but the loops named was closed" if links else "the loops were not closed"
            )
        warnings = [f"{what}: {result.failure}"]
    if named:
        after = dict(zip(trajectories, segments_of(closed), strict=True))
        why = denied_by(named, trajectories, after)
        if why is not None:
            closed, after = estimate, trajectories
            result.record.update(applied=False, reason=why)
            warnings = [f"the loops were not closed, the trajectory is open-loop: {why}"]
        result.record["named"], doubts = outcomes(named, trajectories, after)
        warnings += doubts
    record = {
        "parts": describe_parts_of([NAME], parts),
        "candidates": describe_matches([NAME], matches),
        "groups": [[part.segment for part in group] for group in together],
        "graphs": [group.record for group in groups],
    }
    return Closed(closed, result.record, warnings), record


def _judged(
    breaks: Sequence[Break], together: Sequence[Sequence[Part]], matches: Sequence[Match]
) -> list[Break]:
    """Say of each guess whether the segments on its two sides share a place."""
    group_of = {part.segment: number for number, group in enumerate(together) for part in group}
    n_places = sum(m.believed for m in matches)
    judged, boundary = [], 0
    for broken in breaks:
        if broken.outcome == "guessed":
            before, after = group_of.get(boundary), group_of.get(boundary + 1)
            boundary += 1
            if before is None or before != after:
                broken = replace(broken, outcome="not found")
            else:
                broken = replace(broken, outcome="found", n_places=n_places)
        judged.append(broken)
    return judged
