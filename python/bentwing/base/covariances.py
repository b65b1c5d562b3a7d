# SPDX-License-Identifier: MIT OR Apache-2.0
"""How uncertain the poses of a trajectory are."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.base.clock import NS_PER_S, Clock
from bentwing.base.errors import InputError
from bentwing.base.tum import read_stamped_rows
from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

SHORT = 10.0
"""m, of the path over which short-term errors are stated."""

_UPPER = np.triu_indices(6)
_NAMES = ("rx", "ry", "rz", "x", "y", "z")
_COLUMNS = " ".join(f"{_NAMES[i]}.{_NAMES[j]}" for i, j in zip(*_UPPER, strict=True))
_HEADER = f"""\
# Covariances of the poses in the trajectory beside this file; in between they are interpolated.
# Of a pose's error [rx ry rz x y z], rad and m, map frame: R = Exp(r) R_true, p = p_true + [x y z],
# relative to position and heading of the first pose (in a given map: to the map); up is that of gravity.
# stamp (s, as in the trajectory), then the upper triangle of the 6 x 6 matrix, row by row:
# t {_COLUMNS}
"""


@dataclass(frozen=True, slots=True, eq=False)
class PoseCovariances(Value):
    """Covariances of the poses of a trajectory, relative to position and heading of its first pose.

    The error is on the left: `R = Exp(δr) R_true`, `p = p_true + δt`, in the map frame. Behind a break
    of the recording that nothing bridges they are relative to the first pose behind it, and of a
    trajectory that was found in a given map to that map.

    Attributes
    ----------
    times : (K,) s, increasing
    matrices : (K, 6, 6) of `[δr, δt]`, rad and m
    """

    times: NDArray[np.float64]
    matrices: NDArray[np.float64]

    def at(self, times: Sequence[float] | NDArray[np.float64]) -> NDArray[np.float64]:
        """Return covariances (N, 6, 6) at any times (N,), s; those of the ends beyond them."""
        flat = self.matrices.reshape(len(self.times), 36)
        parts = [np.interp(times, self.times, part) for part in flat.T]
        return np.stack(parts, axis=-1).reshape(-1, 6, 6)

    def levelled(self, positions: Array, gravity_std: Array) -> PoseCovariances:
        """Add what the doubt about the vertical makes of poses.

        Parameters
        ----------
        positions : (K, 3) m, map frame, of the poses
        gravity_std : (2,) rad, of the turns about x and y that levelled the map
        """
        return PoseCovariances(
            self.times, levelled_covariances(self.matrices, positions, gravity_std)
        )

    @classmethod
    def joined(cls, parts: Sequence[PoseCovariances]) -> PoseCovariances | None:
        """Return those of parts that follow each other; None without any."""
        filled = [part for part in parts if len(part.times)]
        if not filled:
            return None
        return cls(
            np.concatenate([p.times for p in filled]), np.concatenate([p.matrices for p in filled])
        )

    def write(self, path: Path | str, clock_origin_ns: int) -> None:
        """Write a line per pose: stamp and the 21 entries of the upper triangle, row by row.

        Parameters
        ----------
        path : file to write, atomically
        clock_origin_ns : absolute time of `times == 0`, ns UTC
        """
        stamps = Clock(clock_origin_ns).to_absolute_text(self.times)
        rows = self.matrices[:, _UPPER[0], _UPPER[1]].tolist()
        lines = [
            f"{stamp} {' '.join(f'{v:.6e}' for v in row)}\n"
            for stamp, row in zip(stamps, rows, strict=True)
        ]
        write_text(Path(path), _HEADER + "".join(lines))

    @classmethod
    def read(cls, path: Path | str, clock_origin_ns: int) -> PoseCovariances:
        """Read what `write` has written.

        Raises
        ------
        InputError
            If the file cannot be read, or a line is not a stamp with 21 finite numbers.
        """
        stamps_ns, rows = read_stamped_rows(Path(path), (22,), f"t {_COLUMNS}")
        if not np.isfinite(rows).all():
            msg = f"{path}: a covariance is not finite"
            raise InputError(msg)
        matrices = np.empty((len(rows), 6, 6))
        matrices[:, _UPPER[0], _UPPER[1]] = rows
        matrices[:, _UPPER[1], _UPPER[0]] = rows
        return cls((stamps_ns - clock_origin_ns) / NS_PER_S, matrices)


def positive_part(matrices: Array) -> Array:
    """Return covariances (K, 6, 6) without negative variances, as those of differences and of rounding."""
    values, vectors = np.linalg.eigh(matrices)
    positive = (vectors * np.maximum(values, 0.0)[:, None, :]) @ vectors.transpose(0, 2, 1)
    # Beside a variance that is huge the smallest ones are rounding again.
    axes = np.arange(6)
    positive[:, axes, axes] = np.maximum(positive[:, axes, axes], 0.0)
    has_negative = (values.min(axis=1) < 0.0) | (matrices[:, axes, axes].min(axis=1) < 0.0)
    return np.asarray(np.where(has_negative[:, None, None], positive, matrices))


def short_pairs(times: Array, positions: Array) -> NDArray[np.intp]:
    """Return pairs (M, 2) of poses between which the path is ten metres long, or next above that.

    Parameters
    ----------
    times : (K,) s, increasing
    positions : (K, 3) m
    """
    path = np.concatenate([[0.0], np.linalg.norm(np.diff(positions, axis=0), axis=1).cumsum()])
    last = np.arange(len(times))
    first = np.searchsorted(path, path - SHORT, side="right") - 1
    return np.stack([first, last], axis=1)[first >= 0]


def levelled_covariances(covariances: Array, positions: Array, gravity_std: Array) -> Array:
    """Add to covariances (K, 6, 6) of poses what the doubt about the vertical makes of them.

    Parameters
    ----------
    positions : (K, 3) m, map frame
    gravity_std : (2,) rad, of the turns about x and y that levelled the map
    """
    levelled = covariances.copy()
    for axis, std in enumerate(gravity_std):
        direction = np.eye(3)[axis]
        effect = np.hstack(
            [np.tile(direction, (len(positions), 1)), np.cross(direction, positions)]
        )
        levelled += std**2 * effect[:, :, None] * effect[:, None, :]
    return levelled


def carried(covariance: Array, displacement: Array) -> Array:
    """Return the covariance (6, 6) of a pose that is fixed to another one with this covariance.

    Parameters
    ----------
    displacement : (3,) m, map frame, from the other pose to this one
    """
    x, y, z = displacement
    effect = np.eye(6)
    effect[3:, :3] = [[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]]
    return np.asarray(effect @ covariance @ effect.T)
