# SPDX-License-Identifier: MIT OR Apache-2.0
"""Marks on which the carrier stood for a while: where they are in the map follows from the trajectory."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.base.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.control_points import ControlPoint

STILL = 0.05  # m; what moves farther does not stand
_STEP = 0.02  # s


def with_places(points: Sequence[ControlPoint], trajectory: Trajectory) -> tuple[ControlPoint, ...]:
    """Return marks with the places in the map at which the carrier stood on them.

    Raises
    ------
    InputError
        If it was not recorded then, or moved.
    """
    return tuple(
        point if point.standing is None else replace(point, picked=_place(point, trajectory))
        for point in points
    )


def _place(point: ControlPoint, trajectory: Trajectory) -> NDArray[np.float64]:
    stood = point.standing
    assert stood is not None
    first, last = float(trajectory.times[0]), float(trajectory.times[-1])
    when = f"{point.name} was stood on from {stood.first:g} to {stood.last:g} s"
    if not first <= stood.first <= stood.last <= last:
        msg = (
            f"{when}, and the trajectory goes from {first:.1f} to {last:.1f} s; give time and until in "
            "seconds since the start of the recording"
        )
        raise InputError(msg)
    times = np.arange(stood.first, stood.last + _STEP / 2, _STEP).clip(max=stood.last)
    positions, quats = trajectory.interpolate(times)
    places = positions + geometry.rotate(quats, np.tile(stood.foot, (len(times), 1)))
    moved = float(np.ptp(places, axis=0).max())
    if moved > STILL:
        msg = (
            f"{when}, and moved by {moved:.2f} m meanwhile; give the times at which it stood still"
        )
        raise InputError(msg)
    middle: NDArray[np.float64] = np.median(places, axis=0)
    return middle
