# SPDX-License-Identifier: MIT OR Apache-2.0
"""Odometry while the sensors deliver: batches in at any time, the pose now and the map so far out."""

from __future__ import annotations

import weakref
from collections import Counter
from functools import partial
from threading import Lock
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.arguments import thread_count
from bentwing.base.errors import UsageError
from bentwing.base.log import get_logger
from bentwing.flight.control import StallWatch
from bentwing.flight.live.backlog import Backlog
from bentwing.flight.live.clocks import LiveClocks
from bentwing.flight.live.inputs import InputOrder
from bentwing.flight.live.live_map import LiveMap, MapUpdate
from bentwing.flight.live.prediction import StampedPose, past_pose
from bentwing.flight.live.state import LiveState, Published
from bentwing.flight.live.status import Status, status_of
from bentwing.flight.live.watchdog import Watchdog
from bentwing.flight.live.worker import Worker
from bentwing.odometry import create
from bentwing.recording.batches import EncoderBatch, ImuBatch, LidarBatch
from bentwing.recording.payload import as_payload
from bentwing.recording.preprocess import Preprocessing
from bentwing.recording.readings import ImuReading, Readings

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray
    from typing_extensions import Self

    from bentwing.base.estimate import Estimate
    from bentwing.base.trajectory import Trajectory
    from bentwing.base.window_record import WindowRecord
    from bentwing.flight.control import Stall
    from bentwing.odometry import EstimatorName, EstimatorSettings
    from bentwing.recording.batches import Batch
    from bentwing.recording.payload import PayloadLike

_log = get_logger(__name__)


class Odometry:
    """Odometry and map while the sensors deliver.

    Feed what comes, from any thread; windows are registered in a thread of the object's own, and
    `pose` never waits for it. All times are seconds since one start of your choice, near the first
    sample: subtract it from the stamps while they are integers. Stamps that jitter are put where the
    period of their sensor says, as far as that is known by then. Points carry the lidar's stamps,
    everything else the IMU's; the latency between both is estimated.

    Parameters
    ----------
    payload : the sensor head, or the payload.yaml that describes it; None: a generic lidar without IMU
    estimator : `continuous`; or for a 3D lidar, with the pose corrected ten times a second, `kalman`
        with an IMU, or `ndt`, which needs none
    settings : of the estimator; default: as `map_recording`
    threads : for one registration; default: all cores
    map_spacing : m, edge of the voxels that keep one point of the map each
    max_map_points : the map never holds more, at 20 bytes each: `map_spacing` doubles instead
    max_lag : s that registration may be late; points are thinned out before, and counted
    usual_rate : rad/s at which the head is held or commanded; with it `stall` tells when it stands
    """

    def __init__(
        self,
        payload: PayloadLike,
        *,
        estimator: EstimatorName = "continuous",
        settings: EstimatorSettings | None = None,
        threads: int | None = None,
        map_spacing: float = 0.1,
        max_map_points: int = 5_000_000,
        max_lag: float = 10.0,
        usual_rate: float | None = None,
    ) -> None:
        if not (np.isfinite(map_spacing) and map_spacing > 0):
            msg = f"map_spacing: expected a length above zero, got {map_spacing} m"
            raise UsageError(msg)
        if max_map_points < 1 or not max_lag > 0:
            msg = f"max_map_points and max_lag: expected above zero, got {max_map_points}, {max_lag} s"
            raise UsageError(msg)
        head, n_threads = as_payload(payload), thread_count(threads)
        self._payload, self._readings = head, Readings.of(head)
        self._spin = None if usual_rate is None else StallWatch(usual_rate)
        self._backlog = Backlog(max_lag)
        self._dropped: Counter[str] = Counter({"live.points_dropped": 0})
        self._filtered: Counter[str] = Counter()
        self._order = InputOrder()
        self._clocks = LiveClocks()
        self._feeding = Lock()
        self._state = LiveState()
        self._engine = create(estimator, head, settings, threads)
        self._shift = self._engine.step_length
        self._final: Estimate | None = None
        self._cached: tuple[Published, Estimate] | None = None
        self._newest_point = -np.inf
        self._worker = Worker(
            self._engine,
            Preprocessing(head, self._filtered),
            self._state,
            Watchdog(head),
            partial(LiveMap, map_spacing, max_map_points, n_threads),
        )
        # Not a method of this object, which could then never be collected.
        self._stop = weakref.finalize(self, self._worker.stop)

    def add_imu(self, times: ArrayLike, gyro: ArrayLike, accel: ArrayLike) -> None:
        """Take inertial samples, one or many.

        Parameters
        ----------
        times : (M,) or a number, s, IMU clock, not before what was added last
        gyro : (M, 3) or (3,), rad/s, imu frame, or in the units and on the axes that the payload names
        accel : (M, 3) or (3,), m/s², imu frame (specific force: +g upwards at rest), or likewise

        Raises
        ------
        ValueError
            If the batch cannot be used; nothing of it is taken.
        """
        self._add_imu(times, gyro, accel, self._readings.imu, self._clocks)

    def _add_imu(
        self,
        times: ArrayLike,
        gyro: ArrayLike,
        accel: ArrayLike,
        reading: ImuReading,
        clocks: LiveClocks | None,
    ) -> None:
        with self._feeding:
            batch = self._order.imu(times, gyro, accel, reading)
            if self._payload.imu is None or self._state.began_without_imu:
                msg = (
                    f"IMU batch at {batch.times[:1]} s: the estimate goes without inertial samples; "
                    "describe the IMU in the payload, and feed it before the points' first six seconds"
                )
                raise ValueError(msg)
            if clocks is None:
                self._take(batch)
            else:
                self._take(clocks.imu(batch), batch)

    def add_points(
        self,
        points: ArrayLike,
        times: ArrayLike,
        rings: ArrayLike | None = None,
        *,
        stamp: float | None = None,
    ) -> None:
        """Take returns of the lidar, a scan or less.

        Parameters
        ----------
        points : (N, 3), m, lidar frame, or scaled and mirrored as the payload says
        times : (N,), s, lidar clock, non-decreasing, not before what was added last
        rings : (N,), beam numbers of a multi-beam lidar, for `kalman`, which is better with them
        stamp : s, of the scan or sweep, from which the times count; with it the jitter of a periodic
            lidar's stamps is taken off the times, which may then overlap the batch before

        Raises
        ------
        ValueError
            If the batch cannot be used; nothing of it is taken.
        """
        with self._feeding:
            batch = self._order.points(
                points, times, rings, self._readings.lidar, overlaps=stamp is not None
            )
            if stamp is None:
                self._take(batch)
            else:
                self._take(self._clocks.points(batch, float(stamp)), batch)

    def add_encoder(self, times: ArrayLike, angles: ArrayLike) -> None:
        """Take angles of the motor that turns the lidar, one or many.

        Parameters
        ----------
        times : (K,) or a number, s, lidar clock, not before what was added last
        angles : (K,) or a number, rad or the payload's unit, unwrapped (continuous over full turns)

        Raises
        ------
        ValueError
            If the batch cannot be used; nothing of it is taken.
        """
        with self._feeding:
            batch = self._order.encoder(times, angles, self._readings.encoder)
            self._take(self._clocks.encoder(batch), batch)

    def feed(self, batch: Batch) -> None:
        """Take a batch as a `Recording` streams it, to replay one."""
        # A recording has read its samples as the payload says already, and their stamps as a clock.
        if isinstance(batch, ImuBatch):
            self._add_imu(batch.times, batch.gyro, batch.accel, ImuReading(), None)
            return
        with self._feeding:
            if isinstance(batch, LidarBatch):
                self._take(self._order.points(batch.points, batch.times, batch.ring))
            else:
                self._take(self._order.encoder(batch.times, batch.angles))

    def pose(self, at: float | None = None) -> StampedPose:
        """Return the pose of the IMU in the map; takes well below a millisecond.

        From the last registered window on, the IMU carries it with the biases and the gravity
        estimated there; when a window is registered, the next pose takes its correction at once.

        Parameters
        ----------
        at : s, IMU clock with the payload's `clock_offset`; default: the newest inertial sample (without an IMU: the newest point)

        Raises
        ------
        NotEnoughDataError
            While the start is waited for.
        ValueError
            If `at` is before the first pose, or beyond the newest data by more than 0.1 s.
        EstimationError
            If the estimate has failed.
        """
        self._worker.require_health()
        time = self._state.newest_time(self._newest_point) if at is None else float(at)
        pose = self._state.pose(time, self._newest_point)
        return past_pose(self.trajectory, time) if pose is None else pose

    @property
    def trajectory(self) -> Trajectory:
        """What is registered so far, at 100 Hz; `Trajectory.write_tum` writes it."""
        return self.estimate().trajectory

    def estimate(self) -> Estimate:
        """Return what is registered so far: trajectory, calibration, records of the windows.

        Raises
        ------
        NotEnoughDataError
            While the start is waited for.
        """
        if self._final is not None:
            return self._final
        newest, cached = self._state.require(), self._cached
        if cached is None or cached[0] is not newest:
            cached = newest, newest.snapshot.estimate()
            self._cached = cached
        return cached[1]

    def map_points(self) -> NDArray[np.float32]:
        """Return the map so far (N, 3), m, map frame: one point per voxel.

        A point stays where the first registration of its window put it, some millimetres from where
        later windows would; `bentwing.map_recording` makes the map of record.
        """
        newest = self._state.newest
        return np.empty((0, 3), np.float32) if newest is None else newest.cloud.points()

    def new_points(self) -> MapUpdate:
        """Return what has come to the map since the last call."""
        newest = self._state.newest
        if newest is None:
            return MapUpdate(np.empty((0, 3), np.float32), replaces=False)
        return newest.cloud.update()

    @property
    def status(self) -> Status:
        """How far the estimate can be relied upon.

        `waiting` for the end of the rest, or for the six seconds in which it is looked for: no pose
        yet. `initializing`: poses, but latency, mount and biases are still being learned.
        `tracking`. `degenerate`: the surfaces of the last window leave a direction unseen, the IMU
        carries it. `coasting`: there was no window for longer than two shifts, the lidar is silent or
        registration too slow; the IMU alone carries the pose. `failed`: feeding and reading raise why,
        within ten seconds of motion where units, axes, mount or clocks are wrong.
        """
        if self._worker.error is not None:
            return "failed"
        age = self._state.age(self._newest_point)
        return status_of(self._state.newest, age, self._shift)

    @property
    def stall(self) -> Stall | None:
        """The stall of the head that lasts, with a warning for the pilot; None while it turns.

        Seen by the encoder, or without one by an IMU that turns with the head, as soon as they are
        fed: no registration is waited for. What a long stall may cut is two maps then, see `Estimate`.

        Raises
        ------
        UsageError
            Without `usual_rate`.
        """
        if self._spin is None:
            msg = "a stall is a drop from the usual rate: give it as Odometry(..., usual_rate=...), rad/s"
            raise UsageError(msg)
        return self._spin.stall

    def surfel_normals(self) -> NDArray[np.float64]:
        """Return the normals (N, 3), map frame, of what the last window has seen, for `SpinTarget`."""
        newest = self._state.newest
        return np.empty((0, 3)) if newest is None else newest.registered.normals()

    @property
    def health(self) -> WindowRecord | None:
        """The record of the last window, as in `Estimate.windows`; None while waiting."""
        newest = self._state.newest
        return None if newest is None else newest.registered.windows[-1]

    @property
    def counts(self) -> dict[str, int]:
        """Points dropped for lack of time (`live.points_dropped`) and by the payload's filters."""
        return {**self._dropped, **self._filtered}

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until everything fed is registered as far as it can be, as a replay wants to.

        Returns
        -------
        bool
            Whether it is, within `timeout` seconds.
        """
        return self._worker.wait(timeout)

    def finish(self) -> Estimate:
        """Register the rest, close, and return what `map_recording` would estimate from the same.

        Raises
        ------
        EstimationError
            If nothing could be estimated, or the estimate has failed.
        """
        if self._final is None:
            self._worker.finish()
            self._final = self._engine.result()
        self.close()
        return self._final

    def close(self) -> None:
        """End the thread; what was estimated can still be read."""
        self._stop()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _take(self, batch: Batch, given: Batch | None = None) -> None:
        """Take a batch, whose times may be others than those that were given."""
        if not len(batch.times):
            return
        if isinstance(batch, LidarBatch) and not self._has_time(batch):
            if not self._dropped["live.points_dropped"]:
                _log.warning(
                    "registration falls behind: scans are left out from %.2f s on", batch.times[0]
                )
            self._dropped["live.points_dropped"] += len(batch.times)
        else:
            self._worker.put(batch)
        self._order.accept(batch if given is None else given)
        self._watch_spin(batch)
        if isinstance(batch, ImuBatch):
            self._state.add_imu(batch)
        elif isinstance(batch, LidarBatch):
            self._newest_point = float(batch.times[-1])

    def _watch_spin(self, batch: Batch) -> None:
        if self._spin is None:
            return
        if isinstance(batch, EncoderBatch):
            self._spin.add_encoder(batch.times, batch.angles)
        elif isinstance(batch, ImuBatch) and self._payload.encoder is None:
            self._spin.add_gyro(batch.times, batch.gyro)

    def _has_time(self, batch: LidarBatch) -> bool:
        self._worker.require_health()
        newest, end = self._state.newest, float(batch.times[-1])
        return newest is None or self._backlog.has_time(end, newest.registered.end, self._shift)
