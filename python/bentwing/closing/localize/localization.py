# SPDX-License-Identifier: MIT OR Apache-2.0
"""From an estimate in its own frame to the estimate in a map's, by places."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bentwing.base.errors import EstimationError
from bentwing.closing.localize.placement import place_in_map
from bentwing.closing.places import MatchSettings, describe_stream, match_places
from bentwing.map.project import project

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from bentwing.base.estimate import Estimate
    from bentwing.closing.localize.prior_map import PriorMap
    from bentwing.closing.places import Candidate, Place
    from bentwing.recording import Batch


# Who names a map knows which site it is of, and that things may have been moved there since.
SAME_SITE = MatchSettings(max_changed=0.05)


@dataclass(frozen=True, slots=True)
class Localized:
    """An estimate where it is in a map, to within reach of the registration.

    Attributes
    ----------
    estimate : in the map's frame
    record : how it came there, for run.json
    """

    estimate: Estimate
    record: dict[str, Any]


def find_in_map(
    estimate: Estimate,
    batches: Iterable[Batch],
    prior: PriorMap,
    *,
    threads: int | None = None,
) -> Localized:
    """Find a recording in a map without a guess where it is.

    Parameters
    ----------
    estimate : open-loop, in its own frame
    batches : of the recording it is of

    Raises
    ------
    NotInMapError
        If no place was recognized, or others that are as many put it elsewhere.
    """
    chunks = project(
        batches,
        estimate.trajectory,
        estimate.calibration,
        segments=estimate.segments,
        threads=threads,
    )
    places = describe_stream(chunks, estimate.trajectory, estimate.spans)
    candidates = match_places(prior.places, places, settings=SAME_SITE)
    record: dict[str, Any] = {
        "map": str(prior.path),
        "map_points": prior.n_points,
        "map_places": len(prior.places),
        "places": len(places),
        "candidates": [_candidate(c, places) for c in candidates],
    }
    placement = place_in_map(estimate, candidates, places)
    if placement is None:
        raise NotInMapError(_unplaced(prior, places, candidates), record)
    record["supporters"] = placement.supporters
    record["T_map_run"] = placement.T_map_run.tolist()
    record["largest_deformation"] = placement.largest_deformation
    return Localized(placement.estimate, record)


class NotInMapError(EstimationError):
    """Where the recording is in the map is unknown; `record` tells what was tried."""

    def __init__(self, message: str, record: dict[str, Any]) -> None:
        super().__init__(message)
        self.record = record


def _unplaced(prior: PriorMap, places: Sequence[Place], candidates: Sequence[Candidate]) -> str:
    n = sum(c.accepted for c in candidates)
    if n:
        return (
            f"{prior.path}: {n} places of the recording contradict each other on its pose in the map, "
            "and nothing shows which are right; record a longer part of the site"
        )
    return (
        f"{prior.path}: none of the {len(places)} places of the recording was recognized among "
        f"the {len(prior.places)} of the map{_nearest(candidates)}; run.json says why under "
        "localization. Is it the same site, seen from near enough, and is the map level?"
    )


def _nearest(candidates: Sequence[Candidate]) -> str:
    """Say why the pair of places that is most alike was refused, if any was alike at all."""
    alike = [
        (c.agreement.agreement * c.agreement.overlap, c.reason)
        for c in candidates
        if c.agreement is not None and c.agreement.agreement >= SAME_SITE.min_agreement
    ]
    return (
        f" (what speaks against the two places that are most alike: {max(alike)[1]})"
        if alike
        else ""
    )


def _candidate(candidate: Candidate, places: Sequence[Place]) -> dict[str, Any]:
    agreement = candidate.agreement
    return {
        "map_place": candidate.i,
        "span": places[candidate.j].span,
        "votes": candidate.votes,
        "accepted": candidate.accepted,
        "reason": candidate.reason,
        "n_inliers": candidate.n_inliers,
        "overlap": None if agreement is None else agreement.overlap,
        "agreement": None if agreement is None else agreement.agreement,
        "conflict": None if agreement is None else agreement.conflict,
        "changed": agreement is not None and agreement.things is not None,
    }
