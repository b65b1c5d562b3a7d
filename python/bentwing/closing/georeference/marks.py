# SPDX-License-Identifier: MIT OR Apache-2.0
"""Control points in the map: the surfaces or spheres found there, and what is left of their distances."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base import geometry
from bentwing.closing.georeference.control_points import Neighbourhood, Plane, plane_around
from bentwing.closing.georeference.placement import Positions, Surfaces
from bentwing.closing.georeference.spheres import BESIDE, FEWEST, Sphere, sphere_around

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.closing.georeference.control_points import ControlPoint
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
    found : the surface or sphere at each, None where there is none
    false : numbers of control points that are not used, as they contradict the others
    """

    listed: Sequence[ControlPoint]
    targets: Array
    around: list[Neighbourhood]
    found: list[Plane | Sphere | None]
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
            Neighbourhood(middle, mark.radius * (BESIDE if mark.kind == "sphere" else 1.0) + slack)
            for mark, middle in zip(listed, expected, strict=True)
        ]
        for chunk in chunks:
            for one in around:
                one.add(chunk)
        return cls(listed, targets, around, [None] * len(listed))

    def measure(self, placement: Placement, slack: float) -> None:
        """Find the surfaces and spheres at the marks, which may still be off by `slack` m."""
        expected = placement.to_map(self.targets)
        self.found = [
            _found(one, at, mark, slack)
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
        """Return the surfaces found at some of the marks, and their times (K,) s.

        The centre of a sphere is known in all directions, so it is in three surfaces.
        """
        rows = [
            (one.middle, normal, self.targets[number], sigma, one.time)
            for number in numbers
            if (one := self.found[number]) is not None
            for normal, sigma in _directions(one)
        ]
        if not rows:
            return Surfaces.none(), np.empty(0)
        points, normals, targets, sigmas, times = (
            np.array(part) for part in zip(*rows, strict=True)
        )
        return Surfaces(points, normals, targets, sigmas), times

    def seen(self, numbers: Sequence[int]) -> Positions:
        """Return those of some of the marks that were seen in the map; of spheres, the points know better."""
        picked = [number for number in numbers if self._is_seen(number)]
        sigmas = np.array([self.listed[number].sigma for number in picked])
        return Positions(
            np.array([self.listed[number].picked for number in picked]).reshape(-1, 3),
            self.targets[picked],
            sigmas[:, None, None] ** 2 * np.eye(3),
        )

    def n_measured(self, number: int) -> int:
        """Count the measurements of a mark."""
        one = self.found[number]
        return 3 * self._is_seen(number) + (0 if one is None else len(_directions(one)))

    def misfit(self, number: int, placement: Placement) -> float:
        """Sum of squared residuals of a mark in units of their noise, and of what a map bends."""
        squares = 0.0
        if self._is_seen(number):
            squares += (self.seen_off(number, placement) / self.listed[number].sigma) ** 2
        surfaces, _ = self.surfaces([number])
        offsets = surfaces.offsets(placement) / np.hypot(surfaces.sigmas, _SHAPE)
        return squares + float(offsets @ offsets)

    def off(self, number: int, placement: Placement) -> float:
        """Return how far a mark lies from where the map has it, m."""
        one = self.found[number]
        off = 0.0 if one is None else abs(self._off(number, one, placement))
        return max(off, self.seen_off(number, placement)) if self._is_seen(number) else off

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
        """Signed distance, m, of each mark's surface from the mark along the normal, up or outward.

        Of a sphere, the distance of the centres.
        """
        return [
            None if one is None else self._off(number, one, placement)
            for number, one in enumerate(self.found)
        ]

    def _is_seen(self, number: int) -> bool:
        mark = self.listed[number]
        return mark.picked is not None and mark.kind != "sphere"

    def _off(self, number: int, one: Plane | Sphere, placement: Placement) -> float:
        gap = placement.to_level(one.middle[None])[0] - self.targets[number]
        if isinstance(one, Sphere):
            return float(np.linalg.norm(gap))
        return float(gap @ (placement.rotation @ one.normal))

    def seen_off(self, number: int, placement: Placement) -> float:
        """Return how far from its place a mark was seen, m."""
        picked = self.listed[number].picked
        assert picked is not None
        return float(np.linalg.norm(placement.to_level(picked[None])[0] - self.targets[number]))

    def table(self, placement: Placement, before: Sequence[float | None]) -> list[dict[str, Any]]:
        """Return one row per mark for run.json and the report."""
        rows = []
        after, places = self.residuals(placement), placement.to_map(self.targets)
        for number, (mark, one) in enumerate(zip(self.listed, self.found, strict=True)):
            normal = placement.rotation @ one.normal if isinstance(one, Plane) else None
            rows.append(
                {
                    "id": mark.name,
                    "use": mark.use,
                    "in_map": places[number],
                    "kind": mark.kind,
                    "points": 0 if one is None else one.n_points,
                    "normal": normal,
                    "thickness": None if one is None else one.thickness,
                    "sigma": None if one is None else max(s for _, s in _directions(one)),
                    "before": before[number],
                    "residual": after[number],
                    "picked_off": self.seen_off(number, placement)
                    if self._is_seen(number)
                    else None,
                    "contradicts": number in self.false,
                }
            )
        return rows

    def warnings(self) -> list[str]:
        """Name marks that have no surface or no sphere."""
        said = []
        for kind, what in (
            ("surface", "no flat surface was found within the radius of"),
            (
                "sphere",
                f"no sphere of the stated radius that stands free and has {FEWEST} points was found at",
            ),
        ):
            missing = [
                mark.name
                for number, mark in enumerate(self.listed)
                if mark.kind == kind and not self.n_measured(number)
            ]
            if missing:
                said.append(f"{what} {', '.join(missing)}: these control points are not used")
        return said


def _found(
    around: Neighbourhood, at: Array, mark: ControlPoint, slack: float
) -> Plane | Sphere | None:
    if mark.kind == "sphere":
        return sphere_around(around.points, around.times, at, mark.radius, slack)
    return plane_around(around.points, around.times, at, mark.radius, slack)


def _directions(one: Plane | Sphere) -> list[tuple[Array, float]]:
    """Return the unit vectors, map frame, along which a mark is measured, and how well, m."""
    if isinstance(one, Sphere):
        return list(zip(one.axes, one.sigmas.tolist(), strict=True))
    return [(one.normal, one.sigma)]


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
