# SPDX-License-Identifier: MIT OR Apache-2.0
"""A map that is already right, as a part of the system that does not move."""

from __future__ import annotations

import numpy as np

from bentwing import _core
from bentwing.base.trajectory import DT
from bentwing.odometry.continuous.slow_states import N_STATES

# Its own time, s: long enough for the core to see that it rests.
_REST = 2.0

STAMP = 0.5 * _REST
"""Stamp of its surfels, s."""
_ZERO = [0.0, 0.0, 0.0]


def fixed_piece(surfels: _core.Surfels) -> _core.Piece:
    """Return a piece that rests at the map's origin and has no slow state to find.

    As the first piece of a system it defines the map.

    Parameters
    ----------
    surfels : in the map's frame, at `STAMP`
    """
    n = round(_REST / DT) + 1
    still = np.tile([0.0, 0.0, 0.0, 1.0], (n, 1))
    nowhere = (_ZERO, [0.0, 0.0, 0.0, 1.0])
    return _core.Piece(
        _core.Samples(0.0, DT, np.zeros((n, 3)), still),
        [surfels],
        None,
        _core.Globals(
            nowhere, latency=0.0, gyro_bias=_ZERO, accel_bias=_ZERO, gravity=[0.0, 0.0, 9.8]
        ),
        information=np.zeros((N_STATES, N_STATES)),
        offset=[0.0] * N_STATES,
        frozen=[True] * N_STATES,
        optional=[False] * N_STATES,
        doubted=[False] * N_STATES,
        shown_noise=([], []),
    )
