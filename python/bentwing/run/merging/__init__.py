# SPDX-License-Identifier: MIT OR Apache-2.0
"""Runs, or the parts of one, that saw the same places: put together and registered as one.

Places are recognised without a guess; links between them that disagree are rejected with the reason;
parts that nothing links are reported as separate.
"""

from __future__ import annotations

from bentwing.run.merging.maps import MergedMap
from bentwing.run.merging.runs import Merged, merge, merge_into
from bentwing.run.merging.source import open_sources

__all__ = ["Merged", "MergedMap", "merge", "merge_into", "open_sources"]
