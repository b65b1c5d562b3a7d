# SPDX-License-Identifier: MIT OR Apache-2.0
"""What a pose graph consists of, as arrays."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

MAP = -1
"""In place of a link's first node: the map itself, which makes the link a prior."""

_ROUNDING = 1e-6  # of an information's largest entry: what printed digits leave of its symmetry


@dataclass(frozen=True, slots=True)
class Links:
    """Measured poses of nodes as seen from others.

    Attributes
    ----------
    nodes : (L, 2) int64, node from which each was seen (or `MAP`), and node that was seen
    positions : (L, 3) float64, m, of the second node in the frame of the first
    quats_xyzw : (L, 4) float64, unit, its rotation there
    information : (L, 6, 6) float64, inverse covariance of `Log(measured⁻¹ · actual)`, rotation
        first, frame of the second node
    trusted : (L,) bool, beyond doubt, as neighbours in time are; others may turn out to be false
    """

    nodes: NDArray[np.int64]
    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]
    information: NDArray[np.float64]
    trusted: NDArray[np.bool_]

    def __post_init__(self) -> None:
        n = len(self.nodes)
        _require_shape("links.nodes", self.nodes, (n, 2))
        _require_shape("links.positions", self.positions, (n, 3))
        _require_shape("links.quats_xyzw", self.quats_xyzw, (n, 4))
        _require_shape("links.information", self.information, (n, 6, 6))
        _require_shape("links.trusted", self.trusted, (n,))
        wrong = ~semidefinite(self.information)
        if wrong.any():
            row = int(np.argmax(wrong))
            msg = (
                f"links.information: matrix {row} is not symmetric and positive semidefinite; "
                "see `nearest_semidefinite`"
            )
            raise ValueError(msg)

    def __len__(self) -> int:
        return len(self.nodes)


@dataclass(frozen=True, slots=True)
class GravityTerms:
    """Directions of gravity as nodes see them: `‖R_map_node · up − z‖²`, weighted.

    Attributes
    ----------
    nodes : (G,) int64
    ups : (G, 3) float64, unit vectors that point up, frame of the node
    weights : (G,) float64, rad⁻², inverse variance of the direction
    """

    nodes: NDArray[np.int64]
    ups: NDArray[np.float64]
    weights: NDArray[np.float64]

    def __post_init__(self) -> None:
        n = len(self.nodes)
        _require_shape("gravity.nodes", self.nodes, (n,))
        _require_shape("gravity.ups", self.ups, (n, 3))
        _require_shape("gravity.weights", self.weights, (n,))
        if not np.allclose(np.linalg.norm(self.ups, axis=1), 1.0, atol=1e-3):
            msg = "gravity.ups: expected unit vectors"
            raise ValueError(msg)
        if (self.weights < 0).any():
            msg = (
                f"gravity.weights: must not be negative, element {int(np.argmin(self.weights))} is"
            )
            raise ValueError(msg)

    @classmethod
    def none(cls) -> GravityTerms:
        """No terms at all."""
        return cls(np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0))


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Nodes, the links between them, and what holds them in the map.

    Attributes
    ----------
    positions : (N, 3) float64, m, map frame
    quats_xyzw : (N, 4) float64, unit, `R_map_node`
    links : between nodes; priors are links from `MAP`
    fixed : (N,) bool, nodes that stay; at least one, or a prior, for every connected part
    gravity : what the nodes know of it
    """

    positions: NDArray[np.float64]
    quats_xyzw: NDArray[np.float64]
    links: Links
    fixed: NDArray[np.bool_]
    gravity: GravityTerms = field(default_factory=GravityTerms.none)

    def __post_init__(self) -> None:
        n = len(self.positions)
        _require_shape("positions", self.positions, (n, 3))
        _require_shape("quats_xyzw", self.quats_xyzw, (n, 4))
        _require_shape("fixed", self.fixed, (n,))

    def __len__(self) -> int:
        return len(self.positions)


def semidefinite(information: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether each matrix `(L, 6, 6)` is symmetric and positive semidefinite, up to rounding."""
    tolerance = _ROUNDING * np.abs(information).max(axis=(1, 2), initial=0.0)
    asymmetry = np.abs(information - information.swapaxes(1, 2)).max(axis=(1, 2), initial=0.0)
    least = np.linalg.eigvalsh(information).min(axis=1, initial=np.inf)
    good: NDArray[np.bool_] = (asymmetry <= tolerance) & (least >= -tolerance)
    return good


def nearest_semidefinite(information: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the nearest symmetric positive semidefinite matrices `(L, 6, 6)`.

    References
    ----------
    Higham 1988, Computing a nearest symmetric positive semidefinite matrix, theorem 2.1.
    """
    values, vectors = np.linalg.eigh(0.5 * (information + information.swapaxes(1, 2)))
    nearest: NDArray[np.float64] = np.einsum(
        "nij,nj,nkj->nik", vectors, np.maximum(values, 0.0), vectors
    )
    return nearest


def _require_shape(name: str, array: NDArray[Any], expected: tuple[int, ...]) -> None:
    if array.shape != expected:
        msg = f"{name}: expected shape {expected}, got {array.shape}"
        raise ValueError(msg)
