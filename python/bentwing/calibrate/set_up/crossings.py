# SPDX-License-Identifier: MIT OR Apache-2.0
"""How a 2D lidar is mounted, from where the planes of its scans cross.

Two scans that are taken shortly after each other from about the same place see the same along the line
in which their planes cross. The gyro says how the head has turned between them, and the mount where in
each scan that line lies: only with the right mount are both ranges the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base import geometry
from bentwing.calibrate.set_up.axes import angle_between
from bentwing.calibrate.set_up.rotations import spread
from bentwing.calibrate.set_up.scans import MOST_DIFFERENT, attitudes, beams
from bentwing.recording.batches import ImuBatch

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.scans import Scans

PAIRS, LONGEST = 2000, 0.6  # of scans that are compared, and s between them
ACROSS = np.sin(np.radians(10.0))  # planes that cross at a smaller angle tell nothing
FEWEST = 200  # crossings; what fewer say is moved towards what is usual
COARSE, REFINED = 1000, 24  # rotations that are compared, and the best of them
APART = np.radians(15.0)  # between mounts that are told apart; a trial corrects one by 20°
MOST = 48  # mounts that may be worth a trial
STEPS = np.radians(8.0)  # in which a rotation is refined first


@dataclass(frozen=True, slots=True)
class Reading:
    """How the rates of the gyro are read.

    Attributes
    ----------
    delay : s, lidar stamps minus IMU clock
    hand : 1, or -1 where all rates are negated
    """

    delay: float = 0.0
    hand: int = 1


class Crossings:
    """Pairs of scans, in how far they agree where their planes cross.

    Parameters
    ----------
    imu : as it was given, rates in rad/s
    """

    def __init__(self, scans: Scans, imu: ImuBatch) -> None:
        self._scans, self._imu = scans, imu
        random = np.random.default_rng(0)
        lags = max(2, round(LONGEST / scans.interval))
        # At rest scans are alike, which speaks for any delay that has them turn.
        first = random.choice(np.flatnonzero(scans.changing), PAIRS)
        later = first + random.integers(1, lags, PAIRS)
        inside = later < len(scans.times)
        self._first, self._later = first[inside], later[inside]
        self._attitudes = lru_cache(8)(self._attitudes_by)
        self.mounts = lru_cache(8)(self._mounts)
        self.usual = 0.0
        rates = [self.misfit(R) for R in spread(50)]
        self.usual = float(np.median(rates))

    def misfit(self, R: NDArray[np.float64], reading: Reading = Reading()) -> float:
        """Return the mean difference of the logarithms of ranges; R (3, 3) leads from the lidar to the gyro."""
        A = self._attitudes(reading)
        frames = A @ R
        first, later = frames[self._first], frames[self._later]
        lines = np.cross(first[:, :, 2], later[:, :, 2])
        lengths = np.linalg.norm(lines, axis=1)
        crosses = lengths > ACROSS
        total, count = 0.0, 0
        a = np.einsum("kab,ka->kb", first[crosses], lines[crosses])
        b = np.einsum("kab,ka->kb", later[crosses], lines[crosses])
        ranges = self._scans.ranges
        for sign in (1.0, -1.0):
            seen = ranges[self._first[crosses], beams(np.arctan2(sign * a[:, 1], sign * a[:, 0]))]
            again = ranges[self._later[crosses], beams(np.arctan2(sign * b[:, 1], sign * b[:, 0]))]
            apart = np.minimum(np.abs(seen - again), MOST_DIFFERENT)
            known = np.isfinite(apart)
            total += float(apart[known].sum())
            count += int(known.sum())
        return (total + FEWEST * self.usual) / (count + FEWEST)

    def _mounts(self, reading: Reading) -> tuple[tuple[float, NDArray[np.float64]], ...]:
        """Return misfits and rotations (3, 3) that may be the mount, best first.

        Those where the misfit is least around, and some between them: while a head only spins above
        level ground, all mounts of whole families agree as well.
        """
        coarse = self._rated(reading, COARSE)
        refined = sorted((self._refined(R, reading) for _, R in coarse[:REFINED]), key=_first)
        found: list[tuple[float, NDArray[np.float64]]] = []
        for misfit, R in [*refined, *coarse]:
            if len(found) == MOST:
                break
            if all(angle_between(R, other) > APART for _, other in found):
                found.append((misfit, R))
        return tuple(sorted(found, key=_first))

    def least(self, reading: Reading) -> float:
        """Return the misfit of the best rotation, at a glance."""
        coarse = self._rated(reading, COARSE // 4)
        return min(self._refined(R, reading)[0] for _, R in coarse[: REFINED // 6])

    def _rated(self, reading: Reading, n: int) -> list[tuple[float, NDArray[np.float64]]]:
        """Return misfits of n rotations (3, 3) that cover all there are, best first."""
        return sorted(((self.misfit(R, reading), R) for R in spread(n)), key=_first)

    def _refined(
        self, R: NDArray[np.float64], reading: Reading
    ) -> tuple[float, NDArray[np.float64]]:
        from scipy.optimize import minimize
        from scipy.spatial.transform import Rotation

        def turned(vector: NDArray[np.float64]) -> NDArray[np.float64]:
            return np.asarray(Rotation.from_rotvec(vector).as_matrix() @ R)

        simplex = STEPS * np.vstack([np.zeros(3), np.eye(3)])
        options = {"initial_simplex": simplex, "maxfev": 50, "xatol": 1e-2, "fatol": 1e-4}
        best = minimize(
            lambda v: self.misfit(turned(v), reading),
            np.zeros(3),
            method="Nelder-Mead",
            options=options,
        )
        return float(best.fun), turned(best.x)

    def _attitudes_by(self, reading: Reading) -> NDArray[np.float64]:
        rates = reading.hand * self._imu.gyro
        quats = attitudes(ImuBatch(self._imu.times, rates, self._imu.accel))
        times = self._scans.times - reading.delay
        nearest = np.clip(np.searchsorted(self._imu.times, times), 0, len(quats) - 1)
        return geometry.to_matrices(quats[nearest])


def _first(pair: tuple[float, NDArray[np.float64]]) -> float:
    return pair[0]
