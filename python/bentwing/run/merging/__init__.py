# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs, or the parts of one, that saw the same places: put together and registered as one.

Places are recognised without a guess; links between them that disagree are rejected with the reason;
parts that nothing links are reported as separate.
"""

from __future__ import annotations

from bentwing.run.merging.comparisons import Comparisons
from bentwing.run.merging.maps import MergedMap, describe_map, make_map
from bentwing.run.merging.runs import (
    Merged,
    budget_of,
    find_groups,
    merge,
    merge_into,
    settled,
)
from bentwing.run.merging.source import open_sources

__all__ = [
    "Comparisons",
    "Merged",
    "MergedMap",
    "budget_of",
    "describe_map",
    "find_groups",
    "make_map",
    "merge",
    "merge_into",
    "open_sources",
    "settled",
]
