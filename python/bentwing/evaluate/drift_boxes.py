# SPDX-License-Identifier: MIT OR Apache-2.0
"""Drift by length of the way, as boxplots per degree of freedom."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from bentwing.evaluate.statistics import Box
from bentwing.evaluate.trajectory import Drift, drift

if TYPE_CHECKING:
    from bentwing.base.trajectory import Trajectory

LENGTHS = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)  # m
_FEWEST = 10  # segments that make a distribution


@dataclass(frozen=True, slots=True)
class DriftBoxes:
    """Signed drift per metre of the way over segments of one length, in the platform's frame.

    The platform may turn about z as it likes, so that both horizontal axes are one distribution.

    Attributes
    ----------
    length : m
    n_segments : overlapping, one begins every half metre
    horizontal, vertical : m per m
    tilt, heading : rad per m; about the horizontal axes and about the vertical one
    """

    length: float
    n_segments: int
    horizontal: Box
    vertical: Box
    tilt: Box
    heading: Box


def drift_boxes(estimate: Trajectory, reference: Trajectory) -> list[DriftBoxes]:
    """Drift over each of `LENGTHS` that fits into the way.

    Parameters
    ----------
    estimate, reference : on the same clock, the reference with z up

    References
    ----------
    Kaul 2015, section 4.2 and figure 24.
    """
    found = drift(estimate, reference, lengths=LENGTHS)
    return [_boxes(part) for part in found if len(part.vertical) >= _FEWEST]


def _boxes(part: Drift) -> DriftBoxes:
    turns = part.rotation / part.length
    return DriftBoxes(
        part.length,
        len(part.vertical),
        Box.of(part.horizontal.ravel()),
        Box.of(part.vertical),
        Box.of(turns[:, :2].ravel()),
        Box.of(turns[:, 2]),
    )
