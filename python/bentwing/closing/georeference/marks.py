# SPDX-License-Identifier: MIT OR Apache-2.0
"""Control points in the map: the surfaces found around them, and what is left of their distances."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.closing.georeference.control_points import Neighbourhood, plane_around
from bentwing.closing.georeference.placement import Positions, Surfaces

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.control_points import ControlPoint, Plane
    from bentwing.closing.georeference.placement import Placement
    from bentwing.map.chunk import MapChunk

    Array = NDArray[np.float64]

_SHAPE = 0.01  # m, by which a map bends besides what the noise of its points explains


@dataclass(slots=True)
class Marks:
    """Surveyed points with the points of the map around them.

    Attributes
    ----------
    listed : what was surveyed
    targets : (K, 3) m, their places, east, north, up
    around : points of the map near each
    planes : the surface found at each, None where there is none
    false : numbers of control points that are not used, as they contradict the others
    """

    listed: Sequence[ControlPoint]
    targets: Array
    around: list[Neighbourhood]
    planes: list[Plane | None]
    false: set[int] = field(default_factory=set)

    @classmethod
    def collect(
        cls,
        listed: Sequence[ControlPoint],
        targets: Array,
        placement: Placement,
        slack: float,
        chunks: Iterable[MapChunk],
    ) -> Marks:
        """Collect the points of the map around marks that may be off by `slack` m."""
        expected = placement.to_map(targets)
        around = [
            Neighbourhood(middle, mark.radius + slack)
            for mark, middle in zip(listed, expected, strict=True)
        ]
        for chunk in chunks:
            for one in around:
                one.add(chunk)
        return cls(listed, targets, around, [None] * len(listed))

    def measure(self, placement: Placement, slack: float) -> None:
        """Find the surfaces around the marks, which may still be off by `slack` m."""
        expected = placement.to_map(self.targets)
        self.planes = [
            plane_around(one.points, one.times, at, mark.radius, slack)
            for one, at, mark in zip(self.around, expected, self.listed, strict=True)
        ]

    @property
    def used(self) -> list[int]:
        """Numbers of the marks that hold the map."""
        return [
            number
            for number, mark in enumerate(self.listed)
            if mark.use == "control" and number not in self.false
        ]

    def surfaces(self, numbers: Sequence[int]) -> tuple[Surfaces, Array]:
        """Return the surfaces found at some of the marks, and their times (K,) s."""
        rows = [
            (plane, self.targets[number])
            for number in numbers
            if (plane := self.planes[number]) is not None
        ]
        if not rows:
            return Surfaces.none(), np.empty(0)
        planes = [plane for plane, _ in rows]
        surfaces = Surfaces(
            np.array([plane.middle for plane in planes]),
            np.array([plane.normal for plane in planes]),
            np.array([target for _, target in rows]),
            np.array([plane.sigma for plane in planes]),
        )
        return surfaces, np.array([plane.time for plane in planes])

    def seen(self, numbers: Sequence[int]) -> Positions:
        """Return those of some of the marks that were seen in the map."""
        picked = [number for number in numbers if self.listed[number].picked is not None]
        sigmas = np.array([self.listed[number].sigma for number in picked])
        return Positions(
            np.array([self.listed[number].picked for number in picked]).reshape(-1, 3),
            self.targets[picked],
            sigmas[:, None, None] ** 2 * np.eye(3),
        )

    def n_measured(self, number: int) -> int:
        """Count the measurements of a mark."""
        return 3 * (self.listed[number].picked is not None) + (self.planes[number] is not None)

    def misfit(self, number: int, placement: Placement) -> float:
        """Sum of squared residuals of a mark in units of their noise, and of what a map bends."""
        mark, plane, squares = self.listed[number], self.planes[number], 0.0
        if mark.picked is not None:
            squares += (self.seen_off(number, placement) / mark.sigma) ** 2
        if plane is not None:
            across = self._across(number, plane, placement)
            squares += (across / float(np.hypot(plane.sigma, _SHAPE))) ** 2
        return squares

    def off(self, number: int, placement: Placement) -> float:
        """Return how far a mark lies from where the map has it, m."""
        plane = self.planes[number]
        across = 0.0 if plane is None else abs(self._across(number, plane, placement))
        if self.listed[number].picked is None:
            return across
        return max(across, self.seen_off(number, placement))

    def follow(self, before: Trajectory, after: Trajectory) -> None:
        """Move the collected points with the trajectory they were measured from."""
        for one in self.around:
            if not len(one.times):
                continue
            p, q = before.interpolate(one.times)
            moved, turned = after.interpolate(one.times)
            turn = geometry.multiply(turned, geometry.inverse(q))
            one.replace(geometry.rotate(turn, one.points - p) + moved)

    def residuals(self, placement: Placement) -> list[float | None]:
        """Signed distance, m, of each mark's surface from the mark along the normal, up or outward."""
        return [
            None if plane is None else self._across(number, plane, placement)
            for number, plane in enumerate(self.planes)
        ]

    def _across(self, number: int, plane: Plane, placement: Placement) -> float:
        gap = placement.to_level(plane.middle[None])[0] - self.targets[number]
        return float(gap @ (placement.rotation @ plane.normal))

    def seen_off(self, number: int, placement: Placement) -> float:
        """Return how far from its place a mark was seen, m."""
        picked = self.listed[number].picked
        assert picked is not None
        return float(np.linalg.norm(placement.to_level(picked[None])[0] - self.targets[number]))

    def table(self, placement: Placement, before: Sequence[float | None]) -> list[dict[str, Any]]:
        """Return one row per mark for run.json and the report."""
        rows = []
        after, places = self.residuals(placement), placement.to_map(self.targets)
        for number, (mark, plane) in enumerate(zip(self.listed, self.planes, strict=True)):
            rows.append(
                {
                    "id": mark.name,
                    "use": mark.use,
                    "in_map": places[number],
                    "points": 0 if plane is None else plane.n_points,
                    "normal": None if plane is None else placement.rotation @ plane.normal,
                    "thickness": None if plane is None else plane.thickness,
                    "before": before[number],
                    "residual": after[number],
                    "picked_off": None if mark.picked is None else self.seen_off(number, placement),
                    "contradicts": number in self.false,
                }
            )
        return rows

    def warnings(self) -> list[str]:
        """Name marks that have no surface."""
        pairs = zip(self.listed, self.planes, strict=True)
        missing = [mark.name for mark, plane in pairs if plane is None and mark.picked is None]
        if not missing:
            return []
        return [
            f"no flat surface was found within the radius of {', '.join(missing)}: these "
            "control points are not used"
        ]


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Count, root mean square and largest residual by use, m."""
    found: dict[str, Any] = {}
    for use in ("control", "check"):
        left = [
            row["residual"]
            for row in rows
            if row["use"] == use and row["residual"] is not None and not row["contradicts"]
        ]
        if left:
            squares = float(np.sqrt(np.mean(np.square(left))))
            found[use] = {"n": len(left), "rms": squares, "max": float(np.abs(left).max())}
    return found
