# SPDX-License-Identifier: MIT OR Apache-2.0
"""Control points in the map: the surfaces found around them, and what is left of their distances."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.closing.georeference.control_points import Neighbourhood, plane_around
from bentwing.closing.georeference.placement import Surfaces

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.control_points import ControlPoint, Plane
    from bentwing.closing.georeference.placement import Placement
    from bentwing.map.chunk import MapChunk

    Array = NDArray[np.float64]

FAR = 0.1
"""m; nobody sees a mark farther off in a cloud."""


@dataclass(slots=True)
class Marks:
    """Surveyed points with the points of the map around them.

    Attributes
    ----------
    listed : what was surveyed
    targets : (K, 3) m, their places, east, north, up
    around : points of the map near each
    planes : the surface found at each, None where there is none
    """

    listed: Sequence[ControlPoint]
    targets: Array
    around: list[Neighbourhood]
    planes: list[Plane | None]

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

    def surfaces(self, use: str = "control") -> tuple[Surfaces, Array]:
        """Return the surfaces found at marks of one use, and their times (K,) s."""
        rows = [
            (plane, target)
            for mark, plane, target in zip(self.listed, self.planes, self.targets, strict=True)
            if plane is not None and mark.use == use
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
        found: list[float | None] = []
        for plane, target in zip(self.planes, self.targets, strict=True):
            if plane is None:
                found.append(None)
                continue
            gap = placement.to_level(plane.middle[None])[0] - target
            found.append(float(gap @ (placement.rotation @ plane.normal)))
        return found

    def table(self, placement: Placement, before: Sequence[float | None]) -> list[dict[str, Any]]:
        """Return one row per mark for run.json and the report."""
        rows = []
        after, places = self.residuals(placement), placement.to_map(self.targets)
        for mark, plane, place, first, last in zip(
            self.listed, self.planes, places, before, after, strict=True
        ):
            normal = None if plane is None else placement.rotation @ plane.normal
            rows.append(
                {
                    "id": mark.name,
                    "use": mark.use,
                    "in_map": place,
                    "points": 0 if plane is None else plane.n_points,
                    "normal": normal,
                    "thickness": None if plane is None else plane.thickness,
                    "before": first,
                    "residual": last,
                    "picked_off": None if mark.picked is None else self._off(mark, placement),
                }
            )
        return rows

    def warnings(self, placement: Placement) -> list[str]:
        """Name marks that have no surface, or lie elsewhere than the others say."""
        said = []
        pairs = zip(self.listed, self.planes, strict=True)
        missing = [mark.name for mark, plane in pairs if plane is None and mark.picked is None]
        if missing:
            said.append(
                f"no flat surface was found within the radius of {', '.join(missing)}: these "
                "control points are not used"
            )
        for mark in self.listed:
            off = None if mark.picked is None else self._off(mark, placement)
            if off is not None and off > FAR:
                said.append(
                    f"{mark.name} was seen {off:.2f} m from where the other marks put it: check its "
                    "coordinates and map_x, map_y, map_z, or give it the use check"
                )
        return said

    def _off(self, mark: ControlPoint, placement: Placement) -> float:
        """Return how far from its place a mark was seen, m."""
        assert mark.picked is not None
        target = self.targets[[one.name for one in self.listed].index(mark.name)]
        return float(np.linalg.norm(placement.to_level(mark.picked[None])[0] - target))


def summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Count, root mean square and largest residual by use, m."""
    found: dict[str, Any] = {}
    for use in ("control", "check"):
        left = [
            row["residual"] for row in rows if row["use"] == use and row["residual"] is not None
        ]
        if left:
            squares = float(np.sqrt(np.mean(np.square(left))))
            found[use] = {"n": len(left), "rms": squares, "max": float(np.abs(left).max())}
    return found
