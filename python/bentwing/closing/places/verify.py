# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether two places, brought together, are the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.transform import apply, inverse
from bentwing.closing.places.cloud import FLAT, is_plane, opposed
from bentwing.closing.places.refine import SIGMA

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

    from bentwing.closing.places.cloud import Surfels
    from bentwing.closing.places.place import Place
    from bentwing.closing.places.settings import MatchSettings
    from bentwing.closing.places.things import Things

_NEAR = 0.8  # m; a surfel with none of the other place's within it was out of that one's sight
_ALIKE = 9.0  # squared standard deviations between two surfels of the same surface
_QUICK = 300  # surfels of a quick look
_DAMNING = 6.0  # how much more a surfel in free space says than one where it should be
_SIMILAR = np.cos(np.radians(30.0))
_CLOSE = 0.3  # m, across a plane
_MIN_PLANES = 30  # for their median distance to mean something
_PLANELESS = 0.05  # of agreement, that is needed more or less without planes
_MIN_KEPT = 10  # faces of things, for their share to mean anything
_MIN_SURFELS = 80  # that are not flat, for shares to mean anything


@dataclass(frozen=True, slots=True)
class Agreement:
    """How two places agree once they are brought together.

    Floors and ceilings do not count: any two upright places agree on them.

    Attributes
    ----------
    overlap : share of one place's surfels that the other has too, the larger of the two shares
    agreement : of the surfels that both could see, the share that is alike
    conflict : of these surfels, the share that stands where the other place saw through; NaN where
        nobody knows what was seen through
    conditioning : least eigenvalue of the surfels' mean information on yaw and position, between 0
        (some direction is free) and 1/4
    n_alike : surfels that are alike
    distance : m, median distance across the planes of surfels near each other; NaN without planes
    blind : whether of one of the places it is not known what was seen through
    things : which of them were moved, where conflicts had to be explained by that
    """

    overlap: float
    agreement: float
    conflict: float
    conditioning: float
    n_alike: int
    distance: float
    blind: bool = False
    things: Things | None = None

    def objection(self, settings: MatchSettings) -> str | None:
        """Why the places are not believed to be the same, or None if they are."""
        if self.n_alike < _MIN_SURFELS:
            return f"{self.n_alike} surfels are alike, {_MIN_SURFELS} are needed"
        for value, least, name in (
            (self.overlap, settings.min_overlap, "overlap"),
            (self.agreement, self._needed(settings), "agreement"),
            (self.conditioning, settings.min_conditioning, "conditioning"),
        ):
            if value < least:
                return f"{name} is {value:.3g}, {least:g} is needed"
        if self.distance > settings.max_distance:
            return (
                f"planes are {1000 * self.distance:.0f} mm apart, "
                f"{1000 * settings.max_distance:.0f} mm are allowed"
            )
        most = settings.max_leafy_conflict if np.isnan(self.distance) else settings.max_conflict
        if self.conflict > most:
            why = self._unexplained(settings, most)
            return why and f"{self.conflict:.1%} stand where the other place saw through, {why}"
        return None

    def may_have_changed(self, settings: MatchSettings) -> bool:
        """Whether conflicts are more than those of one day, and not too many for things that were moved."""
        return settings.max_conflict < self.conflict <= settings.max_changed

    def _unexplained(self, settings: MatchSettings, most: float) -> str | None:
        """Return why it is not things moved in between that explain the conflicts; None if it is.

        Walls are not moved. Of the things most must be where they were, as in a room that is built alike
        hardly any is; and a match that something speaks against must be sure.
        """
        if self.things is None:
            return f"{max(most, settings.max_changed):.1%} are allowed"
        if self.things.share_pierced > settings.max_pierced:
            return f"{self.things.pierced} of {self.things.walls} on walls, which are not moved"
        if self.things.kept < _MIN_KEPT or self.things.share_kept < settings.min_kept:
            n = self.things.kept + self.things.moved
            return (
                f"and of {n} faces of things {self.things.kept} are where they were: "
                f"{settings.min_kept:.0%} are needed, at least {_MIN_KEPT}"
            )
        if not self.is_sure(settings):
            return f"and agreement is {self.agreement:.3g}, too little where things were moved"
        return None

    @property
    def is_telling(self) -> bool:
        """Whether so much could be seen from both places that it must be alike."""
        return self.n_alike / max(self.agreement, 1e-3) >= _MIN_SURFELS

    def is_sure(self, settings: MatchSettings) -> bool:
        """Whether the places agree so well that nothing else need speak for it."""
        return self.agreement >= settings.min_sure_agreement + self._planeless()

    def _needed(self, settings: MatchSettings) -> float:
        """Agreement that is needed.

        Without planes nothing is compared sharply. Places that share much, and of which it is known
        what they saw through, then contradict each other by that, ten times as much as true ones do;
        others must agree the more.
        """
        if self.blind or self.overlap < settings.wide_overlap:
            return settings.min_sure_agreement + self._planeless()
        return settings.min_agreement - self._planeless()

    def _planeless(self) -> float:
        return _PLANELESS if np.isnan(self.distance) else 0.0


@dataclass(frozen=True, slots=True)
class _View:
    """Surfels of one place as another one sees them.

    Attributes
    ----------
    alike, seen, conflicting : (S,) of the surfels that are not flat
    points, normals : (S, 3) moved
    distances : (P,) m, across the planes of those near a plane of the other place
    """

    alike: NDArray[np.bool_]
    seen: NDArray[np.bool_]
    conflicting: NDArray[np.bool_]
    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    distances: NDArray[np.float64]


def verify(
    a: Place, b: Place, trees: tuple[cKDTree, cKDTree], T_a_b: NDArray[np.float64]
) -> Agreement:
    """Compare what two places saw, given the transform (4, 4) from b to a."""
    views = (_view(a, trees[0], b.surfels, T_a_b), _view(b, trees[1], a.surfels, inverse(T_a_b)))
    alike, seen, conflicting = (
        sum(int(getattr(view, name).sum()) for view in views)
        for name in ("alike", "seen", "conflicting")
    )
    known = [place.free is not None for place in (a, b)]
    return Agreement(
        overlap=max(float(view.alike.mean()) if len(view.alike) else 0.0 for view in views),
        agreement=alike / max(seen, 1),
        conflict=conflicting / max(seen, 1) if any(known) else float("nan"),
        conditioning=_conditioning(views[0]),
        n_alike=min(int(view.alike.sum()) for view in views),
        distance=_median(np.concatenate([view.distances for view in views])),
        blind=not all(known),
    )


def quick_score(place: Place, tree: cKDTree, surfels: Surfels, T: NDArray[np.float64]) -> float:
    """How well a transform that is not yet refined puts some surfels of another place into `place`.

    The share that comes near a surfel with a similar normal, less `_DAMNING` times the share that
    ends where the place saw through: rooms that are built alike have much in common.
    """
    upright = np.flatnonzero(np.abs(surfels.normals[:, 2]) < FLAT)
    some = upright[:: -(-len(upright) // _QUICK) or 1]
    if not len(some):
        return 0.0
    moved, normals = apply(T, surfels.means[some]), surfels.normals[some] @ T[:3, :3].T
    distances, nearest = tree.query(moved, distance_upper_bound=_NEAR)
    near = np.isfinite(distances)
    cosines = np.einsum("ni,ni->n", normals[near], place.surfels.normals[nearest[near]])
    cosines = cosines if place.surfels.signed and surfels.signed else np.abs(cosines)
    # what a plane is off across itself counts, where in its voxel its mean lies does not
    offsets = moved[near] - place.surfels.means[nearest[near]]
    across = np.abs(np.einsum("ni,ni->n", offsets, place.surfels.normals[nearest[near]]))
    similar = (cosines > _SIMILAR) & (across < _CLOSE)
    through = 0 if place.free is None else int(place.free.contains(moved[~near]).sum())
    return float(similar.sum() - _DAMNING * through) / len(some)


def _median(values: NDArray[np.float64]) -> float:
    return float(np.median(values)) if len(values) >= _MIN_PLANES else float("nan")


def _view(place: Place, tree: cKDTree, surfels: Surfels, T: NDArray[np.float64]) -> _View:
    """See the surfels of another place, moved by `T`, from `place`."""
    upright = np.abs(surfels.normals @ T[2, :3]) < FLAT
    moved, R = apply(T, surfels.means[upright]), T[:3, :3]
    distances, nearest = tree.query(moved, k=1, distance_upper_bound=_NEAR)
    near = np.isfinite(distances)
    # the other side of a thin wall says nothing about the side that this place saw
    near[near] = ~opposed(place.surfels[nearest[near]], surfels[upright][near], R)
    rows, columns = np.flatnonzero(near), nearest[near]
    own = place.surfels
    spread = (
        own.covariances[columns]
        + R @ surfels.covariances[upright][rows] @ R.T
        + SIGMA**2 * np.eye(3)
    )
    residuals = moved[rows] - own.means[columns]
    chi2 = np.einsum("ni,ni->n", residuals, np.linalg.solve(spread, residuals[..., None])[..., 0])
    alike = np.zeros(len(moved), dtype=np.bool_)
    alike[rows] = chi2 < _ALIKE
    through = np.zeros(len(moved), dtype=np.bool_)
    if place.free is not None:
        through = place.free.contains(moved) & ~alike
    planes = is_plane(surfels)[upright][rows] & is_plane(own)[columns]
    across = np.abs(np.einsum("ni,ni->n", residuals, own.normals[columns]))[planes]
    normals = surfels.normals[upright] @ R.T
    return _View(alike, near | through, through, moved, normals, across)


def _conditioning(view: _View) -> float:
    """Least eigenvalue of the mean of n nᵀ over yaw (in units of the mean reach) and position."""
    points, normals = view.points[view.alike], view.normals[view.alike]
    if not len(points):
        return 0.0
    arms = points - points.mean(axis=0)
    turn = arms[:, 0] * normals[:, 1] - arms[:, 1] * normals[:, 0]
    reach = np.sqrt((arms[:, :2] ** 2).sum(axis=1).mean())
    rows = np.column_stack([turn / max(reach, 1e-9), normals[:, :2]])
    return float(np.linalg.eigvalsh(rows.T @ rows / len(rows))[0])
