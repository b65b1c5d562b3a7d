# SPDX-License-Identifier: MIT OR Apache-2.0
"""How an inertial unit answers beside its biases: scales, axes askew, forces that feign rates."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.base.value import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

_ARRAYS = ("gyro", "g_sensitivity", "accel", "reference")


def _nothing() -> NDArray[np.float64]:
    return np.zeros((3, 3))


@dataclass(frozen=True, slots=True, eq=False)
class InertialUnit(Value):
    """What turns samples into rates ω and specific forces f, once the biases are known.

    `ω = (I + gyro) (ω_m - b_g) - g_sensitivity (f_m - reference)` and
    `f = f_m - b_a + accel (f_m - reference)`: the biases are what the unit reads too much at rest
    under the force `reference`.

    Attributes
    ----------
    gyro, accel : (3, 3), scales on the diagonal, rad beside it
    g_sensitivity : (3, 3) rad/s per m/s²
    reference : (3,) m/s², imu frame
    main_axis : 0, 1 or 2: turns about this axis are felt by it alone, and both others lean to each
        other alike; this defines the imu frame
    """

    gyro: NDArray[np.float64] = field(default_factory=_nothing)
    g_sensitivity: NDArray[np.float64] = field(default_factory=_nothing)
    accel: NDArray[np.float64] = field(default_factory=_nothing)
    reference: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    main_axis: int = 2

    @property
    def misalignments(self) -> list[tuple[int, int]]:
        """Row and column in `gyro` of each of its three misalignments; the first is a pair."""
        i, j, k = ((self.main_axis + n) % 3 for n in (1, 2, 3))
        return [(i, j), (k, i), (k, j)]

    def rates(
        self, gyro: NDArray[np.float64], accel: NDArray[np.float64], bias: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the angular rates (M, 3), rad/s, of samples (M, 3) with a bias (3,) or (M, 3)."""
        felt = (accel - self.reference) @ self.g_sensitivity.T
        return np.asarray((gyro - bias) @ (np.eye(3) + self.gyro).T - felt)

    def forces(self, accel: NDArray[np.float64], bias: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the specific forces (M, 3), m/s², of samples (M, 3) with a bias (3,) or (M, 3)."""
        return np.asarray(accel - bias + (accel - self.reference) @ self.accel.T)

    def to_json(self) -> dict[str, Any]:
        """Return the unit as run.json has it."""
        return {name: getattr(self, name).tolist() for name in _ARRAYS} | {
            "main_axis": self.main_axis
        }

    @classmethod
    def from_json(cls, described: Mapping[str, Any] | None) -> InertialUnit:
        """Read the unit in a run.json; in one of an earlier version it has no errors but biases."""
        if described is None:
            return cls()
        arrays = {name: np.array(described[name], float) for name in _ARRAYS}
        return cls(**arrays, main_axis=described["main_axis"])
