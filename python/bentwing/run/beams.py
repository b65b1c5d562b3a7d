# SPDX-License-Identifier: MIT OR Apache-2.0
"""The beams of a run's lidar: where the open loop shows them to be off, it is estimated anew."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import TYPE_CHECKING

from bentwing.base.progress import Progress

if TYPE_CHECKING:
    from bentwing.closing.beams import FoundBeams
    from bentwing.run.found import Found
    from bentwing.run.head import Head
    from bentwing.run.stages import Job


def find_in_run(job: Job, found: Found) -> FoundBeams | None:
    """Return by how much the beams are off, where that matters and the payload does not say it."""
    settings = job.settings
    from bentwing.closing.beams import find_beams

    if settings.trust_payload or settings.payload.lidar.beams is not None:
        return None
    if found.estimate is None or found.failure is not None or found.doubt is not None:
        return None
    with job.folder.stage("beams"), Progress().stage("", job.part.length) as unseen:
        batches = job.part.batches(unseen, Counter())
        beams = find_beams(found.estimate, batches, settings.payload)
    return beams if beams is not None and beams.matters else None


def read_by(job: Job, head: Head, beams: FoundBeams) -> Job:
    """Return the job with the recording read by the beams that were found."""
    head.use_beams(beams)
    job = replace(job, part=head.part, settings=head.settings)
    job.folder.record.settings = head.settings.to_json()
    return job
