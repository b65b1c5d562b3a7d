# SPDX-License-Identifier: MIT OR Apache-2.0
"""All faults by name."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bentwing.base.errors import UsageError
from bentwing.simulate.faults import clocks, imus, inertial, mounts, ranging, turning, untimed

if TYPE_CHECKING:
    from bentwing.simulate.faults.fault import Fault
    from bentwing.simulate.names import HeadName

_FAMILIES = (mounts, inertial, imus, clocks, ranging, turning, untimed)
FAULTS: dict[str, Fault] = {fault.name: fault for family in _FAMILIES for fault in family.FAULTS}


def fault_of(name: str, head: HeadName | None = None) -> Fault:
    """Return a fault by its name.

    Raises
    ------
    UsageError
        If there is none of that name, or it cannot be put into the head.
    """
    if name not in FAULTS:
        msg = f"no fault is called {name}; these are: {', '.join(FAULTS)}"
        raise UsageError(msg)
    found = FAULTS[name]
    if head is not None and head not in found.heads:
        msg = f"{name} cannot be put into {head}; it can into {', '.join(found.heads)}"
        raise UsageError(msg)
    return found
