# SPDX-License-Identifier: MIT OR Apache-2.0
"""One fix of a file, and how good its kind usually is."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.recording.gnss_files.names import FixQuality

# Standard deviations, m, of east or north, and up: what a fix counts with where the file has none, and what
# it counts with at least, as receivers take floating ambiguities and single positions for better than they are.
_USUAL = {
    "fixed": (0.02, 0.03),
    "float": (0.3, 0.5),
    "ppp": (0.1, 0.2),
    "differential": (0.7, 1.4),
    "single": (3.0, 6.0),
}
_LEAST = {
    "fixed": (0.0, 0.0),
    "float": (0.1, 0.2),
    "ppp": (0.02, 0.03),
    "differential": (0.3, 0.6),
    "single": (0.7, 1.4),
}


class FileFix(NamedTuple):
    """A position of the antenna.

    Attributes
    ----------
    stamp_ns : UTC
    place : longitude and latitude in deg, and height in m above the ellipsoid
    quality : of the solution
    covariance : (3, 3) m², east, north, up; None where the file says nothing
    """

    stamp_ns: int
    place: tuple[float, float, float]
    quality: FixQuality
    covariance: NDArray[np.float64] | None

    def weighed(self) -> NDArray[np.float64]:
        """Return the covariance (3, 3) m² that the fix counts with."""
        level, up = _USUAL[self.quality]
        if self.covariance is None:
            return np.diag(np.square([level, level, up]))
        level, up = _LEAST[self.quality]
        floor = np.square([level, level, up])
        lacking = np.maximum(floor - np.diag(self.covariance), 0.0)
        weighed: NDArray[np.float64] = self.covariance + np.diag(lacking)
        return weighed


class BadLineError(ValueError):
    """A line of the file is no fix; the text says what is wrong."""
