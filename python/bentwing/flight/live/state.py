# SPDX-License-Identifier: MIT OR Apache-2.0
"""What the registering thread tells the reading ones; no reader ever waits for a registration."""

from __future__ import annotations

from dataclasses import dataclass, field
from threading import Lock
from typing import TYPE_CHECKING

from bentwing.base.errors import NotEnoughDataError
from bentwing.flight.live.imu_tail import ImuTail
from bentwing.flight.live.prediction import MAX_EXTRAPOLATION, OVERLAP, Prediction

if TYPE_CHECKING:
    from bentwing.flight.live.live_map import LiveMap
    from bentwing.flight.live.prediction import StampedPose
    from bentwing.odometry.interface import Registered, Snapshot
    from bentwing.recording.batches import ImuBatch

# While a start is waited for, only this much of the rest is kept, s.
REST = 60.0


@dataclass(frozen=True, slots=True)
class Published:
    """What the newest window has left behind.

    Attributes
    ----------
    snapshot : what the estimator knew then
    cloud : the map of its pass
    """

    snapshot: Snapshot
    cloud: LiveMap
    prediction: Prediction = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "prediction", Prediction(self.registered))

    @property
    def registered(self) -> Registered:
        """What the pass had registered then."""
        return self.snapshot.registered


class LiveState:
    """The newest registered window and the inertial samples since; every call is short."""

    def __init__(self) -> None:
        self._lock = Lock()
        self._imu = ImuTail()
        self._newest: Published | None = None

    @property
    def newest(self) -> Published | None:
        """The newest registered window."""
        return self._newest

    @property
    def began_without_imu(self) -> bool:
        """Whether windows are registered, but no inertial sample has come before them."""
        return self._newest is not None and not len(self._imu)

    def add_imu(self, batch: ImuBatch) -> None:
        """Take inertial samples to predict by."""
        with self._lock:
            self._imu.append(batch)
            if self._newest is None:
                self._imu.forget(self._imu.end - REST - 1.0)

    def publish(self, newer: Published) -> None:
        """Go on from a newer window from now on; an older one, as behind a break, is passed over."""
        with self._lock:
            before = self._newest
            if before is not None and newer.registered.end < before.registered.end:
                return
            self._newest = newer
            self._imu.forget(float(newer.prediction.recent.times[-1]) - 2 * OVERLAP)

    def newest_time(self, newest_point: float) -> float:
        """Return the time of the newest data, or of the newest pose if that is later, s.

        Raises
        ------
        NotEnoughDataError
            There is no pose yet.
        """
        with self._lock:
            return self._newest_time(newest_point)

    def pose(self, at: float, newest_point: float) -> StampedPose | None:
        """Return the pose at a time, s; None if that is before the recent ones.

        Raises
        ------
        NotEnoughDataError, ValueError
            As `Odometry.pose`.
        """
        with self._lock:
            newest, prediction = self._newest_time(newest_point), self.require().prediction
            if not at <= newest + MAX_EXTRAPOLATION:
                msg = (
                    f"at: {at:.3f} s is more than {MAX_EXTRAPOLATION:g} s beyond the newest data, "
                    f"which is from {newest:.3f} s"
                )
                raise ValueError(msg)
            return prediction.pose(at, self._imu) if at >= prediction.start else None

    def age(self, newest_point: float) -> float:
        """Return how much newer than the last window the newest data is, s; 0 without a window."""
        with self._lock:
            newest = self._newest
            return 0.0 if newest is None else self._data_end(newest_point) - newest.registered.end

    def _newest_time(self, newest_point: float) -> float:
        recent = self.require().prediction.recent
        return max(self._data_end(newest_point), float(recent.times[-1]))

    def _data_end(self, newest_point: float) -> float:
        return self._imu.end if len(self._imu) else newest_point

    def require(self) -> Published:
        """Return the newest registered window.

        Raises
        ------
        NotEnoughDataError
            There is none.
        """
        if self._newest is None:
            msg = (
                "no pose yet: the start is looked for in the first six seconds, and a rest is "
                "waited out; see `status`"
            )
            raise NotEnoughDataError(msg)
        return self._newest
