# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far the estimate can be relied upon right now, in one word."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from bentwing.flight.live.state import Published

Status = Literal["waiting", "initializing", "tracking", "degenerate", "coasting", "failed"]

# No window for two of them and this long, s: the lidar is silent, or registration too slow.
COASTING = 0.5


def status_of(newest: Published | None, age: float, shift: float) -> Status:
    """Return the status of an estimate that has not failed.

    Parameters
    ----------
    newest : the last registered window
    age : s, how much newer the newest data is
    shift : s, new data per window
    """
    if newest is None:
        return "waiting"
    if age > 2 * shift + COASTING:
        return "coasting"
    if newest.registered.is_settling:
        return "initializing"
    return "degenerate" if newest.registered.windows[-1].degenerate else "tracking"
