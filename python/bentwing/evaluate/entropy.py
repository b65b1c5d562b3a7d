# SPDX-License-Identifier: MIT OR Apache-2.0
"""Mean map entropy: how crisp a map is, without any reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import cKDTree

from bentwing.base.search_tree import within

if TYPE_CHECKING:
    from numpy.typing import NDArray

RADIUS = 0.3  # m; what the name means in the literature
_FEWEST = 15  # neighbours that give a covariance
_ASKED = 2_000  # points, drawn at random
_MOST_NEIGHBOURS = 2_000  # of a point; of more, as many are drawn
_FLATTEST = 1e-9  # m², so that exactly flat neighbourhoods have an entropy


@dataclass(frozen=True, slots=True)
class MapEntropy:
    """Mean of `½ ln |2πe Σ|` over points, Σ the covariance of what lies within `radius`.

    Lower is crisper. It compares maps of the same place and density only.

    Attributes
    ----------
    mean : nat
    radius : m
    n_points : that were asked and had enough neighbours
    """

    mean: float
    radius: float
    n_points: int


def map_entropy(points: NDArray[np.float64], radius: float = RADIUS) -> MapEntropy | None:
    """Measure the mean map entropy of a cloud (N, 3) m; None where it is too thin everywhere.

    References
    ----------
    Droeschel, Stückler and Behnke 2014, Local multi-resolution representation for 6D motion
    estimation and mapping with a continuously rotating 3D laser scanner.
    """
    if len(points) < _FEWEST:
        return None
    rng = np.random.default_rng(0)
    asked = points if len(points) <= _ASKED else points[rng.choice(len(points), _ASKED, False)]  # noqa: FBT003 - without replacement
    entropies = []
    for found in within(cKDTree(points), asked, radius):
        if len(found) < _FEWEST:
            continue
        around = np.array(found)
        if len(around) > _MOST_NEIGHBOURS:
            around = rng.choice(around, _MOST_NEIGHBOURS, replace=False)
        values = np.linalg.eigvalsh(np.cov(points[around].T, bias=True))
        entropies.append(0.5 * np.sum(np.log(2 * np.pi * np.e * np.maximum(values, _FLATTEST))))
    if not entropies:
        return None
    return MapEntropy(float(np.mean(entropies)), radius, len(entropies))
