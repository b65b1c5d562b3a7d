# SPDX-License-Identifier: MIT OR Apache-2.0
"""The learned linear transform that makes Euclidean distances between descriptors mean something."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

_FILE = "metric.npz"
_RIDGE = 1e-3  # of the mean variance: keeps values that hardly vary from dividing by zero


@dataclass(frozen=True, slots=True)
class Metric:
    """A linear transform of descriptors.

    Attributes
    ----------
    matrix : (D, SIZE); differences of matching descriptors have unit covariance behind it
    reach : distance within which so large a share of matching descriptors lies as learned
    """

    matrix: NDArray[np.float64]
    reach: float

    def apply(self, descriptors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Descriptors (K, SIZE) transformed to (K, D)."""
        return descriptors @ self.matrix.T

    def save(self, path: Path) -> None:
        """Write the transform as float32."""
        np.savez_compressed(
            path, matrix=self.matrix.astype(np.float32), reach=np.float32(self.reach)
        )


def learn_metric(
    matching: NDArray[np.float64],
    others: NDArray[np.float64],
    *,
    dimensions: int,
    share: float = 0.7,
) -> Metric:
    """Learn which combinations of values tell other keypoints from the same one.

    Parameters
    ----------
    matching : (M, SIZE) differences between descriptors of the same keypoint in two runs
    others : (N, SIZE) differences between descriptors of different keypoints
    dimensions : to keep, those in which others differ most, measured by how matching ones do
    share : of the matching pairs that are to lie within `Metric.reach`

    Raises
    ------
    ValueError
        If there are fewer pairs than values in a descriptor.

    References
    ----------
    Bosse and Zlot 2009, Keypoint design and evaluation for place recognition.
    """
    from scipy.linalg import eigh

    size = matching.shape[1]
    if min(len(matching), len(others)) < size:
        msg = f"{len(matching)} matching and {len(others)} other pairs cannot teach {size} values"
        raise ValueError(msg)
    within = matching.T @ matching / len(matching)
    between = others.T @ others / len(others)
    within += _RIDGE * np.trace(within) / size * np.eye(size)
    _, vectors = eigh(between, within)
    matrix = vectors[:, ::-1][:, :dimensions].T
    # the sign of an eigenvector is the library's choice; make it ours
    signs = np.sign(matrix[np.arange(len(matrix)), np.abs(matrix).argmax(axis=1)])
    matrix = np.ascontiguousarray(matrix * signs[:, None])
    distances = np.linalg.norm(matching @ matrix.T, axis=1)
    return Metric(matrix, float(np.quantile(distances, share)))


@cache
def default_metric() -> Metric:
    """Return the transform that comes with the package."""
    with resources.as_file(resources.files("bentwing.closing.places") / _FILE) as path:
        content = np.load(path)
        return Metric(content["matrix"].astype(np.float64), float(content["reach"]))
