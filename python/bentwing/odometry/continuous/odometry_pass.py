# SPDX-License-Identifier: MIT OR Apache-2.0
"""One pass of the sliding window over a recording (Kaul 2015, section 2.1 and 4)."""

from __future__ import annotations

import time
from copy import copy, deepcopy
from typing import TYPE_CHECKING

import numpy as np

from bentwing import _core
from bentwing.base import geometry
from bentwing.base.trajectory import DT, Trajectory
from bentwing.base.window_record import WindowRecord
from bentwing.odometry.continuous.drift import Drift
from bentwing.odometry.continuous.final_poses import FinalPoses
from bentwing.odometry.continuous.slow_states import N_STATES, SlowStatePrior, at_epoch, named_std
from bentwing.odometry.continuous.views import FixedViews
from bentwing.odometry.imu_noise import BelievedNoise
from bentwing.odometry.start import levelling

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.base.covariances import PoseCovariances
    from bentwing.odometry.buffer import BatchBuffer, LidarStretch
    from bentwing.odometry.continuous.core_settings import CoreSettings
    from bentwing.odometry.continuous.settings import ContinuousSettings
    from bentwing.recording import ImuBatch

# The trajectory reaches this much beyond the newest stamp, for latencies of either sign, s.
MARGIN = 0.05
# So many samples are put away at a time.
MANY = 1000
# Without this much spread of the normals a direction is not seen by the matches alone.
MIN_EIGENVALUE = 0.02


class OdometryPass:
    """Runs windows over the data as it comes; holds only what the next window needs.

    Poses that have left the window follow what later ones tell of the slow states.

    Attributes
    ----------
    samples : dense trajectory from a few seconds before the window to its end
    globals : current slow states
    """

    def __init__(
        self,
        samples: _core.Samples,
        slow: _core.Globals,
        prior: SlowStatePrior,
        settings: ContinuousSettings,
        core: CoreSettings,
        *,
        threads: int,
        resting: bool,
    ) -> None:
        """Begin with `samples`; with `resting` all of them are at rest and never corrected."""
        self.samples = samples
        self.globals = slow
        self.prior = prior
        self.windows: list[WindowRecord] = []
        self.n_blind = 0
        self.settings = settings
        self._core = core
        self._noise = BelievedNoise.as_stated(core.noise(DT))
        self._threads = threads
        self._resting = resting
        self._origin = samples.start
        self._first_position = samples.positions[0]
        # Windows begin no earlier than this.
        self._anchor = samples.end if resting else samples.start
        self._surfels: list[tuple[float, _core.Surfels]] = []
        self._views = FixedViews(settings)
        self._finished: list[FinalPoses] = []
        self._end = samples.end
        self._drift = Drift(settings.n_views)
        self.covariance = np.zeros((N_STATES, N_STATES))
        self.timings = {"propagate": 0.0, "surfels": 0.0, "register": 0.0}
        self._finish()  # a rest may have been long

    @property
    def end(self) -> float:
        """Stamp up to which lidar data was used, s."""
        return self._end

    @property
    def length(self) -> float:
        """How much lidar data was used, s."""
        return self._end - self._origin

    @property
    def is_settling(self) -> bool:
        """Whether its windows have not yet reached their full length."""
        return self._end - self._anchor < self.settings.window

    def look_around(self, buffer: BatchBuffer) -> None:
        """Freeze what was seen at rest; a 2D lidar sees no surfels then, a 3D lidar its first view."""
        start = max(self._origin, self._end - self.settings.view_length)
        seen = self._extract(buffer.lidar(start, self._end))
        view = _core.FixedView([seen], start, self._end, self.samples, self.globals)
        self._views.add(view, self.samples.position_at(start))

    def step(self, buffer: BatchBuffer, end: float) -> None:
        """Take the lidar data up to `end`, s, and register the window that ends there."""
        watch = time.perf_counter()
        samples = self._imu(buffer, end)
        imu = _in_core(samples)
        extended, n_blind = self.samples.extended(imu, self.globals, end + MARGIN)
        self.samples = extended
        self.n_blind += n_blind
        watch = self._lap("propagate", watch)
        stretch = buffer.lidar(self._end, end)
        self._surfels.append((self._end, self._extract(stretch)))
        new, self._end = end - self._end, end
        watch = self._lap("surfels", watch)
        if samples is not None:
            self._noise = self._noise.after(samples, settled=not self.is_settling)
        self._register(imu, new)
        self._lap("register", watch)
        self._retire()

    def trajectory(self) -> Trajectory:
        """Return all samples so far, levelled."""
        finished = [f.by(self.globals) for f in self._finished]
        parts = [*finished, (self.samples.positions, self.samples.quats_xyzw)]
        positions, quats = zip(*parts, strict=True)
        return self._levelled(self._origin, np.concatenate(positions), np.concatenate(quats))

    def covariances(self, trajectory: Trajectory) -> PoseCovariances:
        """Return those of some poses of what `trajectory` has returned."""
        return self._drift.covariances(trajectory, self._first_position)

    def short_covariances(self, trajectory: Trajectory) -> NDArray[np.float64]:
        """Return those (M, 6, 6) of poses as seen from the ones ten metres before."""
        return self._drift.short_covariances(trajectory)

    def recent(self) -> Trajectory:
        """Return the end of the trajectory, levelled."""
        samples = self.samples
        return self._levelled(samples.start, samples.positions, samples.quats_xyzw)

    def level(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Turn points (N, 3) so that gravity is vertical, about the first position, m, map frame."""
        first: NDArray[np.float64] = self._first_position
        return first + geometry.rotate(levelling(self.globals.gravity), points - first)

    def normals(self) -> NDArray[np.float64]:
        """Return the normals (N, 3) of the last window's surfels, towards the sensor, map frame."""
        start = self._window_start(self._end)
        parts = [self._normals_of(s) for t, s in self._surfels if t >= start - 1e-6]
        return np.concatenate(parts) if parts else np.empty((0, 3))

    def _normals_of(self, surfels: _core.Surfels) -> NDArray[np.float64]:
        order = np.argsort(surfels.stamps, kind="stable")
        means, stamps = surfels.means[order], surfels.stamps[order]
        has_motor = self.globals.motor_lidar_translation is not None
        angles = surfels.angles[order] if has_motor else None
        ends = [
            self.samples.place(points, stamps, angles, self.globals, threads=self._threads)
            for points in (means, means + surfels.normals[order])
        ]
        return geometry.rotate(levelling(self.globals.gravity), ends[1] - ends[0])

    def _levelled(
        self, start: float, positions: NDArray[np.float64], quats: NDArray[np.float64]
    ) -> Trajectory:
        turn = np.broadcast_to(levelling(self.globals.gravity), quats.shape)
        times = start + DT * np.arange(len(positions), dtype=np.float64)
        return Trajectory(times, self.level(positions), geometry.multiply(turn, quats))

    def snapshot(self) -> OdometryPass:
        """Return the state as it is now, which stays so while the pass goes on."""
        frozen = copy(self)
        frozen.windows = [*self.windows]
        frozen.prior = deepcopy(self.prior)
        frozen.timings = dict(self.timings)
        frozen._surfels = [*self._surfels]
        frozen._views = copy(self._views)
        frozen._finished = [*self._finished]
        frozen._drift = deepcopy(self._drift)
        return frozen

    def _imu(self, buffer: BatchBuffer, end: float) -> ImuBatch | None:
        if not buffer.has_imu:
            return None
        return buffer.imu(self._window_start(end) - 0.2, end + MARGIN + 0.2)

    def _extract(self, stretch: LidarStretch) -> _core.Surfels:
        return _core.extract_surfels(
            stretch.points,
            stretch.times,
            stretch.angles,
            self.samples,
            self.globals,
            settings=self.settings.surfels,
            range_sigma=self._core.range_sigma,
            threads=self._threads,
        )

    def _window_start(self, end: float) -> float:
        return max(self._anchor, end - self.settings.window)

    def _register(self, imu: _core.Imu | None, new: float) -> None:
        start = self._window_start(self._end)
        first = max(0, round((start - self.samples.start) / DT))
        window = self.samples.slice(first, len(self.samples) - 1)
        joined = self._resting or start > self._origin
        result = _core.register_window(
            window,
            [s for t, s in self._surfels if t >= start - 1e-6],
            self._views.around(self.samples.position_at(self._end)),
            imu,
            self.globals,
            information=self.prior.information,
            offset=self.prior.offset,
            frozen=self.prior.frozen.tolist(),
            joined=joined,
            settings=self._core.with_noise(self._noise.now, DT),
            threads=self._threads,
        )
        moved = result.globals.moved_from(self.globals)
        self.samples = self.samples.following(moved).replaced(first, result.samples)
        self.globals = result.globals
        self.covariance = self.prior.discounted(result.covariance)
        leaving = self._window_start(self._end + self.settings.shift)
        self._drift.add(result, start, leaving, self._end)
        length = self._end - start
        self.prior.carry(result.covariance, result.offset, min(new, length), length)
        self.windows.append(self._record(result))

    def _record(self, result: _core.Registration) -> WindowRecord:
        translation = list(result.translation_eigenvalues)
        rotation = list(result.rotation_eigenvalues)
        n_matches = result.n_matches + result.n_fixed_matches
        has_imu = result.gyro_rms is not None or result.accel_rms is not None
        degenerate = n_matches == 0 or min(translation[0], rotation[0]) < MIN_EIGENVALUE
        return WindowRecord(
            time=self._end,
            n_surfels=result.n_surfels,
            n_matches=result.n_matches,
            n_fixed_matches=result.n_fixed_matches,
            inlier_share=result.inlier_share,
            residual_rms=result.residual_rms,
            gyro_rms=result.gyro_rms,
            accel_rms=result.accel_rms,
            gyro_correlation=result.gyro_correlation,
            accel_correlation=result.accel_correlation,
            imu_noise=[self._noise.now.gyro, self._noise.now.accel] if has_imu else None,
            iterations=result.n_outer,
            converged=result.converged,
            degenerate=degenerate,
            weakest_direction=list(result.weakest_direction) if degenerate else None,
            translation_eigenvalues=translation,
            rotation_eigenvalues=rotation,
            n_blind=result.n_blind,
            latency=self.globals.latency_at(self._end),
            gyro_bias=self.globals.gyro_bias.tolist(),
            accel_bias=self.globals.accel_bias.tolist(),
            gravity=self.globals.gravity.tolist(),
            extrinsic_translation=self.globals.base_translation.tolist(),
            extrinsic_quat_xyzw=self.globals.base_quat_xyzw.tolist(),
            std=named_std(
                at_epoch(self.covariance, self._end - self.globals.latency_epoch),
                self.prior.frozen,
            ),
        )

    def _retire(self) -> None:
        """Freeze what has left the window, and forget what no view can need any more."""
        next_start = self._window_start(self._end + self.settings.shift)
        self._views.update(self._surfels, next_start, self.samples, self.globals)
        oldest = self._oldest()
        self._surfels = [(t, s) for t, s in self._surfels if t >= oldest]
        self._finish()

    def _finish(self) -> None:
        """Put away samples that no window or view can need any more."""
        n = round((self._oldest() - self.samples.start) / DT)
        if n > MANY:
            self._finished.append(FinalPoses(self.samples, n, self.globals))
            self.samples = self.samples.slice(n, len(self.samples) - 1)

    def _oldest(self) -> float:
        """Time from which on samples and surfels may still be needed, s."""
        next_start = self._window_start(self._end + self.settings.shift)
        return next_start - self.settings.view_length - self.settings.shift

    def _lap(self, name: str, since: float) -> float:
        now = time.perf_counter()
        self.timings[name] += now - since
        return now


def _in_core(batch: ImuBatch | None) -> _core.Imu | None:
    if batch is None:
        return None
    return _core.Imu(batch.times, batch.gyro, batch.accel, batch.at_limit)
