# SPDX-License-Identifier: MIT OR Apache-2.0
"""Scans of E57 files through the optional package pye57, each put in its place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.map.formats import require_package

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from numpy.typing import NDArray

_AXES = ("cartesianX", "cartesianY", "cartesianZ")


def e57_scans(path: Path) -> Iterator[tuple[NDArray[np.float64], None]]:
    """Read the points of one station after the other; times are not read."""
    file = require_package("e57").E57(str(path))
    try:
        for scan in range(file.scan_count):
            if not file.get_header(scan).point_count:
                continue
            # with its pose applied, and without the returns that the scanner calls invalid
            columns = file.read_scan(scan, ignore_missing_fields=True)
            yield np.stack([columns[axis] for axis in _AXES], axis=1).astype(np.float64), None
    finally:
        file.close()
