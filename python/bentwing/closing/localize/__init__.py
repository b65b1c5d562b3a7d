# SPDX-License-Identifier: MIT OR Apache-2.0
"""A recording in a map that is already there: where it is, and what has changed.

The map becomes surfels that do not move. Places say where the recording is in it, without a guess; then the
whole trajectory is registered with it (Kaul 2015, sections 2.1 and 2.2).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing.closing.localize.coordinates import GivenCoordinates
    from bentwing.closing.localize.difference import Difference, ReferenceCloud
    from bentwing.closing.localize.localization import Localized, NotInMapError, find_in_map
    from bentwing.closing.localize.placement import Placement, place_in_map
    from bentwing.closing.localize.prior_map import PriorMap, read_prior_map
else:
    from bentwing.base.lazy import lazy

    __getattr__, __dir__ = lazy(
        __name__,
        {
            "closing.localize.coordinates": ["GivenCoordinates"],
            "closing.localize.difference": ["Difference", "ReferenceCloud"],
            "closing.localize.localization": ["Localized", "NotInMapError", "find_in_map"],
            "closing.localize.placement": ["Placement", "place_in_map"],
            "closing.localize.prior_map": ["PriorMap", "read_prior_map"],
        },
    )

__all__ = [
    "Difference",
    "GivenCoordinates",
    "Localized",
    "NotInMapError",
    "Placement",
    "PriorMap",
    "ReferenceCloud",
    "find_in_map",
    "place_in_map",
    "read_prior_map",
]
