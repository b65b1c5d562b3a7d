# SPDX-License-Identifier: MIT OR Apache-2.0
"""Finds, while a recording is read, what the lidar sees of its own carrier."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.carrier.cells import carrier_cells
from bentwing.calibrate.carrier.view import View
from bentwing.recording.batches import LidarBatch
from bentwing.recording.described import described_mount
from bentwing.recording.sections.self_hits import Box, SelfHit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import Payload

LENGTH = 1.25  # s of a view
# Share of directions in which another surface must be seen; at rest it is below 0.1.
CHANGED = 0.3
MIN_VIEWS, ENOUGH_VIEWS = 6, 40
MARGIN = 0.05  # m around what was seen
MAX_BOXES = 4
MIN_SHARE = 2e-4  # of the near points; less is not worth a box


class CarrierWatch:
    """Takes preprocessed batches, keeps views between which the surroundings change.

    Parameters
    ----------
    payload : whose encoder, if there is one, tells how the lidar is turned on the carrier
    """

    def __init__(self, payload: Payload) -> None:
        self._mount = described_mount(payload)
        self._pending: list[LidarBatch] = []
        self._views: list[View] = []

    def add(self, batch: Batch) -> None:
        """Take the next batch."""
        if not isinstance(batch, LidarBatch) or len(self._views) > ENOUGH_VIEWS:
            return
        self._pending.append(batch)
        if batch.times[-1] - self._pending[0].times[0] < LENGTH:
            return
        view, self._pending = View.of(self._pending, self._mount), []
        if not self._views or view.differs_from(self._views[-1]) > CHANGED:
            self._views.append(view)

    def boxes(self) -> tuple[SelfHit, ...]:
        """Return boxes around what the lidar saw of its carrier, in the lidar frame.

        None where it saw nothing of it, or where the surroundings changed too little to tell.
        """
        views = self._views[1:]  # the first may be from a long rest, in which all is the same
        if len(views) < MIN_VIEWS:
            return ()
        points = np.concatenate([view.points for view in views]).astype(np.float64)
        cells = np.concatenate([view.cells for view in views])
        parts = [points[np.isin(cells, part)] for part in carrier_cells(views)]
        if sum(map(len, parts)) < MIN_SHARE * len(points):
            return ()
        return tuple(_box(low, high) for low, high in _few([_extent(part) for part in parts]))


def carrier_warnings(payload: Payload, boxes: Sequence[SelfHit]) -> list[str]:
    """Return the sentence on a carrier that comes into the map, with the boxes to paste."""
    if payload.self_hits or not boxes:
        return []
    listed = ", ".join(
        f"{{box: {{min: {list(one.box.min)}, max: {list(one.box.max)}}}}}" for one in boxes
    )
    return [
        "the lidar sees its own carrier, which comes into the map as a shell around the path; to leave "
        f"it out, write into the payload 'self_hits: [{listed}]'"
    ]


def _extent(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return lowest and highest corner (2, 3) with the margin, in whole centimetres."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    return np.stack([np.floor(100 * low), np.ceil(100 * high)]) / 100


def _few(extents: list[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Join boxes that touch, and those next to each other until there are few."""
    found = list(extents)
    while len(found) > 1:
        joins = [(_join(found[i], found[j]), i, j) for j in range(len(found)) for i in range(j)]
        joined, i, j = min(
            joins,
            key=lambda join: _volume(join[0]) - _volume(found[join[1]]) - _volume(found[join[2]]),
        )
        touching = _volume(joined) <= _volume(found[i]) + _volume(found[j])
        if not touching and len(found) <= MAX_BOXES:
            break
        found = [one for k, one in enumerate(found) if k not in (i, j)] + [joined]
    return found


def _join(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack([np.minimum(one[0], other[0]), np.maximum(one[1], other[1])])


def _volume(extent: NDArray[np.float64]) -> float:
    return float(np.prod(extent[1] - extent[0]))


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> SelfHit:
    corners = ([round(float(c), 2) for c in corner] for corner in (low, high))
    return SelfHit(box=Box.model_validate(dict(zip(("min", "max"), corners, strict=True))))
