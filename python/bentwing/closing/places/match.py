# SPDX-License-Identifier: MIT OR Apache-2.0
"""Find the places of one run that another run saw too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.log import get_logger
from bentwing.closing.places.consensus import Hypothesis, hypotheses
from bentwing.closing.places.metric import Metric, default_metric
from bentwing.closing.places.refine import COARSE, FINE, Alignment, refine
from bentwing.closing.places.settings import MatchSettings
from bentwing.closing.places.things import compare_things
from bentwing.closing.places.verify import Agreement, quick_score, verify
from bentwing.closing.places.vote import likely_pairs, vote

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray
    from scipy.spatial import cKDTree

    from bentwing.closing.places.place import Place

_WORTH_REFINING = 0.6  # agreement after the coarse alignment
# Transforms closer than this, m, in the middle of a place and so far from it, m, are one.
_SAME, _ARM = 0.1, 10.0
_FAR = "too few surfels are near each other"

_log = get_logger(__name__)


@dataclass(frozen=True, slots=True)
class Candidate:
    """A pair of places that was considered.

    Attributes
    ----------
    i, j : place of run a, place of run b
    votes : of similar descriptors
    reason : why it was rejected, None if it was accepted
    n_inliers : keypoints that agree on the transform; 0 where none was tried
    alignment : the transform and its information, where there is one
    agreement : what the two places say about it
    """

    i: int
    j: int
    votes: float
    reason: str | None
    n_inliers: int = 0
    alignment: Alignment | None = None
    agreement: Agreement | None = None

    @property
    def accepted(self) -> bool:
        """Whether the places are believed to be the same."""
        return self.reason is None


def match_places(
    a: Sequence[Place],
    b: Sequence[Place],
    *,
    settings: MatchSettings | None = None,
    metric: Metric | None = None,
) -> list[Candidate]:
    """Find the places of run b that are places of run a too, without a guess of their relative poses.

    Parameters
    ----------
    a, b : places of two runs, or of the same one
    settings : default: those for all scenes
    metric : default: that which comes with the package

    Returns
    -------
    All pairs of places that were considered, accepted or not, in the order of (i, j); `alignment.T_a_b`
    takes coordinates in b's map to coordinates in a's.

    References
    ----------
    Kaul 2015, section 2.2; Bosse and Zlot 2013.
    """
    from scipy.spatial import cKDTree

    settings, metric = settings or MatchSettings(), metric or default_metric()
    votes = vote(a, b, metric, settings.n_neighbours)
    likely = likely_pairs(votes, settings.min_votes, settings.max_candidates)
    trees_a, trees_b = ([cKDTree(place.surfels.means) for place in run] for run in (a, b))
    found = []
    for i, j in np.ndindex(votes.shape):
        if i_votes := float(votes[i, j]):
            found.append(
                _tried((i, j, i_votes), (a[i], b[j]), (trees_a[i], trees_b[j]), metric, settings)
                if likely[i, j]
                else Candidate(i, j, i_votes, _too_few(i_votes, settings))
            )
    n_accepted = sum(candidate.accepted for candidate in found)
    _log.info("of %d pairs of places with votes %d are accepted", len(found), n_accepted)
    return found


def match_pair(
    a: Place,
    b: Place,
    guesses: Sequence[NDArray[np.float64]],
    *,
    keypoints: bool = True,
    settings: MatchSettings | None = None,
) -> Candidate:
    """Judge two places that somebody takes for the same.

    Parameters
    ----------
    guesses : transforms (4, 4) from b's map to a's to begin with
    keypoints : whether what looks alike may propose others
    settings : default: those for all scenes
    """
    from scipy.spatial import cKDTree

    settings = settings or MatchSettings()
    proposed = [Hypothesis(T, 0) for T in guesses]
    if keypoints:
        proposed += hypotheses(a, b, default_metric(), settings.n_hypotheses)
    trees = cKDTree(a.surfels.means), cKDTree(b.surfels.means)
    best = _best((0, 0, 0.0), (a, b), trees, proposed, settings)
    return best or Candidate(0, 0, 0.0, _FAR)


def verified(a: Place, b: Place, T_a_b: NDArray[np.float64]) -> Agreement:
    """Compare what two places saw, given the transform (4, 4) from b to a."""
    from scipy.spatial import cKDTree

    return verify(a, b, (cKDTree(a.surfels.means), cKDTree(b.surfels.means)), T_a_b)


def _too_few(votes: float, settings: MatchSettings) -> str:
    if votes < settings.min_votes:
        return f"{votes:.1f} votes, {settings.min_votes:g} are needed"
    return f"{votes:.1f} votes, {settings.max_candidates} other pairs of either place have more"


def _tried(
    named: tuple[int, int, float],
    places: tuple[Place, Place],
    trees: tuple[cKDTree, cKDTree],
    metric: Metric,
    settings: MatchSettings,
) -> Candidate:
    """Verify a candidate by its geometry: the transform that fits best decides."""
    proposed = hypotheses(*places, metric, settings.n_hypotheses)
    promising = [h for h in proposed if h.n_inliers >= settings.min_inliers]
    best = _best(named, places, trees, promising, settings)
    if best is None:
        most = max((h.n_inliers for h in proposed), default=0)
        reason = f"{most} keypoints agree on a transform, {settings.min_inliers} are needed"
        return Candidate(*named, reason, most)
    return best


def _best(
    named: tuple[int, int, float],
    places: tuple[Place, Place],
    trees: tuple[cKDTree, cKDTree],
    promising: list[Hypothesis],
    settings: MatchSettings,
) -> Candidate | None:
    """Return what the hypothesis that fits best becomes; None without any."""
    a, b = places
    best: Candidate | None = None
    promising = sorted(promising, key=lambda h: -quick_score(a, trees[0], b.surfels, h.T_a_b))
    known: list[NDArray[np.float64]] = []
    for hypothesis in promising[: settings.n_refined]:
        tried = _judged(named, places, trees, hypothesis, settings, known=known)
        if tried is not None and (best is None or _merit(tried) > _merit(best)):
            best = tried
        if best is not None and best.accepted:
            break
    return best


def _judged(
    named: tuple[int, int, float],
    places: tuple[Place, Place],
    trees: tuple[cKDTree, cKDTree],
    hypothesis: Hypothesis,
    settings: MatchSettings,
    *,
    known: list[NDArray[np.float64]],
) -> Candidate | None:
    """Refine a hypothesis and verify it; None where it becomes one of those `known`, which it joins."""
    a, b = places
    alignment = refine(a.surfels, trees[0], b.surfels, hypothesis.T_a_b, COARSE)
    if alignment is None:
        return Candidate(*named, _FAR, hypothesis.n_inliers)
    if any(_alike(alignment.T_a_b, T, b.centre) for T in known):
        return None
    known.append(alignment.T_a_b)
    agreement = verify(a, b, trees, alignment.T_a_b)
    # a finer alignment takes most of the time, and does not move what stands in the way
    most = max(settings.max_conflict, settings.max_leafy_conflict, settings.max_changed)
    hopeless = agreement.conflict > most
    if agreement.agreement > _WORTH_REFINING and not hopeless:
        finer = refine(a.surfels, trees[0], b.surfels, alignment.T_a_b, FINE)
        if finer is None:
            return Candidate(*named, _FAR, hypothesis.n_inliers)
        alignment, agreement = finer, verify(a, b, trees, finer.T_a_b)
    if agreement.may_have_changed(settings):
        agreement = replace(agreement, things=compare_things(a, b, alignment.T_a_b))
    reason = agreement.objection(settings) or _leaning(alignment.T_a_b)
    return Candidate(*named, reason, hypothesis.n_inliers, alignment, agreement)


def _alike(one: NDArray[np.float64], other: NDArray[np.float64], at: NDArray[np.float64]) -> bool:
    """Whether two transforms put the middle of a place, and what is 10 m around, to the same place."""
    change = one - other
    shift = float(np.linalg.norm(change[:3, :3] @ at + change[:3, 3]))
    return shift + _ARM * float(np.linalg.norm(change[:3, :3])) < _SAME


def _leaning(T_a_b: NDArray[np.float64], most: float = np.radians(3.0)) -> str | None:
    """Object to a transform that tilts one gravity-aligned map against the other."""
    tilt = float(np.arccos(np.clip(T_a_b[2, 2], -1.0, 1.0)))
    if tilt <= most:
        return None
    return f"tilts one map against the other by {np.degrees(tilt):.1f}°, {np.degrees(most):.0f}° are allowed"


def _merit(candidate: Candidate) -> tuple[bool, float]:
    """Return the order of transforms of the same pair: those that are believed, then those that agree most."""
    agreement = candidate.agreement
    score = 0.0 if agreement is None else agreement.agreement * agreement.overlap
    return candidate.accepted, score
