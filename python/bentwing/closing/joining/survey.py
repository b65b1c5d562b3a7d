# SPDX-License-Identifier: MIT OR Apache-2.0
"""One pass over a recording: the places it saw, and the surfels and inertial samples for later."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.closing.global_registration import Collector, GlobalSettings, Recorded
from bentwing.closing.places import describe_stream
from bentwing.map.project import project

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from bentwing.base.estimate import Estimate
    from bentwing.closing.places import Place
    from bentwing.recording import Batch, Payload


@dataclass(frozen=True, slots=True)
class Survey:
    """What a recording saw.

    Attributes
    ----------
    name : of the run
    recorded : estimate, surfels and inertial samples
    places : in order of time
    segments : of each place, the number of the segment of the trajectory that it is of
    """

    name: str
    recorded: Recorded
    places: list[Place]
    segments: list[int]


def survey(
    name: str,
    estimate: Estimate,
    batches: Iterable[Batch],
    payload: Payload,
    *,
    surfel_rate: float,
    settings: GlobalSettings | None = None,
    threads: int | None = None,
) -> Survey:
    """Go through a recording once.

    Parameters
    ----------
    surfel_rate : most surfels per second
    settings : of the registration that follows; default: its defaults
    """
    settings = settings or GlobalSettings()
    collector = Collector(
        estimate,
        length=settings.stretch,
        settings=settings.surfels.model_copy(update={"max_rate": surfel_rate}),
        range_sigma=payload.lidar.range_sigma,
        threads=threads or 0,
    )

    def collected() -> Iterator[Batch]:
        for batch in batches:
            collector.add(batch)
            yield batch

    whole = estimate.trajectory
    chunks = project(
        collected(), whole, estimate.calibration, segments=estimate.segments, threads=threads
    )
    places = [
        place
        for place in describe_stream(chunks, whole, estimate.spans)
        if len(place.surfels) and len(place.keypoints)
    ]
    segments, inertial = collector.result()
    starts = [float(s.trajectory.times[0]) for s in segments]
    middles = [middle_of(place) for place in places]
    numbers = np.searchsorted(starts, middles, side="right") - 1
    return Survey(name, Recorded(estimate, payload, segments, inertial), places, numbers.tolist())


def middle_of(place: Place) -> float:
    """Time of a place, s."""
    if place.span is None:
        msg = "place.span: expected the times of its points, got None"
        raise ValueError(msg)
    return 0.5 * (place.span[0] + place.span[1])
