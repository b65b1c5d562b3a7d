# SPDX-License-Identifier: MIT OR Apache-2.0
"""Try a description of the head on some seconds of a recording."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.errors import BentwingError
from bentwing.odometry.continuous.estimator import Continuous
from bentwing.odometry.continuous.settings import ContinuousSettings, RegistrationSettings

if TYPE_CHECKING:
    from bentwing.base.calibration import Calibration
    from bentwing.base.window_record import WindowRecord
    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.recording import ImuBatch, Payload

# Of a right description 0.97 of the matches and more agree, of a wrong one at most 0.92.
# In a glance a right description is a little blurred by where it came from, and in some seconds that
# begin in the middle of a motion still by how it began.
PROMISING, LIKELY = 0.88, 0.92
# A wrong description never settles; a right one does soon.
SETTINGS = ContinuousSettings(registration=RegistrationSettings(max_outer=8))
# Forces are in units of a noise that is known to a factor only; with one axis negated they are off by 8. Of a
# right description of an IMU that hardly shakes they are off by 0.5 to 1.2, of a mirror image by 3.6 to 5.3.
LEAST_INLIERS, MOST_RESIDUAL, MOST_FORCE, FEWEST_MATCHES = 0.95, 0.7, 5.0, 150
STRAINED = 2.5


@dataclass(frozen=True, slots=True)
class Trial:
    """What the estimator makes of a description.

    Attributes
    ----------
    payload : the description
    last : its last window; None where it could not follow at all
    calibration : what it has learned of the head
    """

    payload: Payload
    last: WindowRecord | None = None
    calibration: Calibration | None = None

    @property
    def score(self) -> float:
        """Matches that agree, less those that do not."""
        if self.last is None or self.last.inlier_share is None:
            return 0.0
        return self.n_matches * (2.0 * self.last.inlier_share - 1.0)

    @property
    def n_matches(self) -> int:
        """Pairs of surfaces in the last window, those with what it saw before included."""
        return 0 if self.last is None else self.last.n_matches + (self.last.n_fixed_matches or 0)

    @property
    def is_promising(self) -> bool:
        """Whether most of what was seen fits together."""
        last = self.last
        return (
            last is not None
            and self.n_matches >= FEWEST_MATCHES
            and (last.inlier_share or 0.0) >= PROMISING
        )

    @property
    def is_likely(self) -> bool:
        """Whether what was seen fits together so well that a longer time is worth a look."""
        return self._agrees(LIKELY)

    @property
    def is_consistent(self) -> bool:
        """Whether what was seen fits together."""
        return self._agrees(LEAST_INLIERS)

    def _agrees(self, least_inliers: float) -> bool:
        last = self.last
        return (
            last is not None
            and last.inlier_share is not None
            and last.residual_rms is not None
            and self.n_matches >= FEWEST_MATCHES
            and last.inlier_share >= least_inliers
            and last.residual_rms <= MOST_RESIDUAL
            # In a mirrored world the surfaces agree as well, but not the forces.
            and self.force <= MOST_FORCE
        )

    @property
    def force(self) -> float:
        """By how many times its noise the accelerometer feels other than what the surfaces show."""
        return 0.0 if self.last is None else self.last.accel_rms or 0.0

    @property
    def is_strained(self) -> bool:
        """Whether the forces fit a right description badly: others are to be tried before."""
        return self.force > STRAINED

    @property
    def sentence(self) -> str:
        """Say how badly it fits."""
        best = "in the mount and with the axes that fit best"
        share = None if self.last is None else self.last.inlier_share
        if share and share >= LEAST_INLIERS:
            return (
                f"the surfaces that the lidar has seen twice agree, but {best} the accelerometer feels "
                "another motion than they show: check the axes of the IMU and the lidar's ranges"
            )
        agree = "none of" if not share else f"only {share:.0%} of"
        return (
            f"{agree} the surfaces that the lidar has seen twice agree, {best}: check that the IMU is on "
            "the lidar's head, works and was recorded with it, and the lidar's ranges and the times of "
            "its points"
        )


def try_payload(stretch: Stretch, payload: Payload, threads: int | None = None) -> Trial:
    """Estimate a stretch with a description of the head; the priors are as wide as it says."""
    engine = Continuous(payload, SETTINGS, threads)
    try:
        for batch in stretch.preprocessed(payload):
            engine.feed(batch)
        found = engine.result()
    except BentwingError:
        return Trial(payload)
    return Trial(payload, found.windows[-1] if found.windows else None, found.calibration)


def richest(imu: ImuBatch, length: float) -> tuple[float, float]:
    """Return start and end, s, of the part in which the head turns most."""
    steps = np.linalg.norm(imu.gyro[1:], axis=1) * np.diff(imu.times)
    turned = np.concatenate([[0.0], np.cumsum(steps)])
    starts = np.arange(imu.times[0], max(imu.times[-1] - length, imu.times[0]) + 0.1, 0.5)
    ahead = np.interp(starts + length, imu.times, turned) - np.interp(starts, imu.times, turned)
    start = float(starts[int(np.argmax(ahead))])
    return start, start + length
