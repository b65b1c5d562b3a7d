# SPDX-License-Identifier: MIT OR Apache-2.0
"""Judge a recording: what prevents mapping, and what may make the map worse.

`bentwing info` and `bentwing map` judge by the same small part: the first minute of the IMU, all of
it for a 2D lidar, and the lidar's first return.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.inspection.planar import MIN_CORRELATION, ScanTurns, level_share
from bentwing.recording import imu_units, problems
from bentwing.recording.batches import LidarBatch
from bentwing.recording.messages.lidar_messages import LASER_SCAN, is_planar
from bentwing.recording.preprocess import find_static_start

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.calibrate.inspection.spin import Spin
    from bentwing.recording.recording import Recording

Stretch = tuple[float, float]
MIN_IMU_RATE_HZ = 90.0
USABLE_IMU_RATE_HZ = 4.0  # with less, every sample is behind a break
ALWAYS_LEVEL = 0.95  # share of time


@dataclass(frozen=True, slots=True)
class Judgement:
    """What was found.

    Attributes
    ----------
    defects, warnings : what prevents mapping, what may make the map worse
    static_start : (start, end) s, if any
    gyro_scale : what makes rad/s of the gyro where its unit is certainly wrong, else 1
    """

    defects: list[str]
    warnings: list[str]
    static_start: Stretch | None
    gyro_scale: float


@dataclass(frozen=True, slots=True)
class _Imu:
    """Samples of the IMU: (M,) s, (M, 3), (M, 3), in the units of the recording."""

    times: NDArray[np.float64]
    gyro: NDArray[np.float64]
    accel: NDArray[np.float64]

    @property
    def beginning(self) -> tuple[NDArray[np.float64], ...]:
        """Times, gyro and accel of the part by which units are judged."""
        n = int(np.searchsorted(self.times, self.times[0] + imu_units.CHECKED))
        return self.times[:n], self.gyro[:n], self.accel[:n]


def judge(recording: Recording, *, has_payload: bool) -> Judgement:
    """Judge a recording by a small part of it; defects say how to repair them.

    Parameters
    ----------
    recording : that is not strict
    has_payload : whether the sensor head is described, so that what depends on the mount can be told
    """
    can_be_level = is_planar(recording.lidar_type)
    can_be_level &= recording.encoder_topic is None
    seconds = np.inf if can_be_level else imu_units.CHECKED
    imu = _Imu(*recording.first_imu(seconds))
    # The mount comes first: what follows takes the frames as it says.
    defects = _time_defects(recording) + recording.clock_problems()
    defects += _mount_defects(recording, has_payload=has_payload)
    warnings: list[str] = []
    static, scale = None, 1.0
    if len(imu.times) and _rate_hz(imu.times) < USABLE_IMU_RATE_HZ:
        return Judgement([*defects, _too_slow(recording, imu)], warnings, static, scale)
    if len(imu.times):
        judged = imu.beginning
        units = None if recording.payload.imu is None else recording.payload.imu.units
        wrong = imu_units.problems(judged[0], judged[1], judged[2], units)
        defects += [f"{recording.imu_topic}: {text}" for text in wrong]
        scale = imu_units.gyro_scale(*judged)
        start = find_static_start(judged[0], *imu_units.in_si(*judged))
        static = None if start is None else (start.start, start.end)
        warnings += _imu_rate(recording, judged[0]) + _start_warnings(static)
        if (mirrored := imu_units.mirrored_axis(judged[0], *imu_units.in_si(*judged))) is not None:
            warnings.append(f"{recording.imu_topic}: {mirrored}")
    if can_be_level:
        found, unknown = _planar(recording, imu, scale, has_payload=has_payload)
        defects, warnings = defects + found, warnings + unknown
    defects += _blind(recording)
    return Judgement(defects, warnings, static, scale)


def _start_warnings(static: Stretch | None) -> list[str]:
    if static is not None:
        return []
    return [
        "no static start: the recording begins in motion or the gyro has a large bias at rest; let "
        "the head rest for some seconds before it moves, it makes the first seconds better"
    ]


def _time_defects(recording: Recording) -> list[str]:
    return [] if recording.point_times else [recording.point_times_problem]


def _rate_hz(times: NDArray[np.float64]) -> float:
    return 0.0 if len(times) < 2 else 1.0 / max(float(np.median(np.diff(times))), 1e-9)


def _too_slow(recording: Recording, imu: _Imu) -> str:
    n, rate_hz = len(imu.times), _rate_hz(imu.times)
    found = f"{rate_hz:.1f} Hz" if rate_hz else f"{n} message{'s'[: n != 1]} only"
    return (
        f"{recording.imu_topic}: {found}, and between the samples nothing tells how the head moves; "
        "set the IMU to 100 Hz or more"
    )


def _imu_rate(recording: Recording, times: NDArray[np.float64]) -> list[str]:
    rate_hz = _rate_hz(times)
    if rate_hz >= MIN_IMU_RATE_HZ:
        return []
    return [
        f"{recording.imu_topic}: {rate_hz:.0f} Hz is slow for a moving lidar; set the IMU to 100 "
        "Hz or more"
    ]


def _planar(
    recording: Recording, imu: _Imu, gyro_scale: float, *, has_payload: bool
) -> tuple[list[str], list[str]]:
    """Return defects and warnings on a 2D lidar that no encoder turns."""
    if not len(imu.times):
        return [
            f"{recording.lidar_topic}: a 2D lidar without IMU and encoder; nothing tells how its "
            "scan plane moves, record one of them too"
        ], []
    if not _is_level(recording, imu):
        return [], []
    agreement = _scan_agreement(recording, imu, gyro_scale)
    # A level plane turns with or against the gyro, in any mount.
    turns = agreement is not None and abs(agreement) >= MIN_CORRELATION
    if not has_payload and not turns:
        return [], [_unknown_plane(recording)]
    defects = [] if agreement is None or agreement > -MIN_CORRELATION else [_mirrored(recording)]
    doubt = ""
    if recording.payload.places_lidar_on_imu and not turns:
        doubt = "correct T_imu_lidar if the lidar is mounted otherwise, "
    return [
        *defects,
        f"{recording.lidar_topic}: a 2D lidar whose scan plane stays level sees one slice of the "
        f"surroundings and cannot make a 3D map; {doubt}spin or nod the lidar, or use a 2D SLAM program",
    ], []


def _is_level(recording: Recording, imu: _Imu) -> bool:
    half = max(1, int(0.25 / max(float(np.median(np.diff(imu.times))), 1e-6)))
    kernel = np.ones(2 * half + 1)
    smooth = np.column_stack([np.convolve(axis, kernel, "same") for axis in imu.accel.T])
    return level_share(smooth, _R_imu_lidar(recording)) >= ALWAYS_LEVEL


def _scan_agreement(recording: Recording, imu: _Imu, gyro_scale: float) -> float | None:
    """Correlate the turn of a level 2D lidar from scan to scan with the gyro about its normal."""
    turns = _scan_turns(recording)
    if turns is None:
        return None
    for batch in recording.batches():
        if isinstance(batch, LidarBatch):
            turns.add(batch)
            if turns.is_full:
                break
    rates = gyro_scale * imu.gyro @ _R_imu_lidar(recording)[:, 2]
    return turns.agreement(imu.times, rates - np.median(rates))


def _scan_turns(recording: Recording) -> ScanTurns | None:
    if recording.lidar_type != LASER_SCAN:
        return None
    count = next(t.count for t in recording.topics if t.name == recording.lidar_topic)
    period = recording.duration / max(1, count - 1)
    has_beam_times = recording.point_times is not None
    if has_beam_times and not np.isfinite(period):
        return None
    return ScanTurns(period if has_beam_times and period > 0 else None)


def _mirrored(recording: Recording) -> str:
    return (
        f"{recording.imu_topic}: the gyro turns against the scans of {recording.lidar_topic} about "
        "the scan plane's normal, so one axis is mirrored; say in the payload which: T_imu_lidar if the "
        "lidar is mounted upside down, 'lidar: {mirrored: true}' if its scans run the other way, or "
        "the gyro's axis along the normal in imu.gyro_axes"
    )


def _unknown_plane(recording: Recording) -> str:
    return (
        f"{recording.lidar_topic}: whether the scan plane sweeps space cannot be told without "
        "knowing how the lidar is mounted; give the payload.yaml with --payload"
    )


def _mount_defects(recording: Recording, *, has_payload: bool) -> list[str]:
    if recording.imu_topic is None or recording.payload.places_lidar_on_imu or not has_payload:
        return []
    turned = recording.payload.encoder is not None
    return [problems.mount(recording.imu_topic, turned=turned)]


def _blind(recording: Recording) -> list[str]:
    """Look for the first return: a lidar that saw nothing at all was covered or off."""
    if any(isinstance(batch, LidarBatch) and len(batch.points) for batch in recording.batches()):
        return []
    return [
        f"{recording.lidar_topic}: no valid return at all; check that the lidar was not covered and "
        "that it was switched on"
    ]


def _R_imu_lidar(recording: Recording) -> NDArray[np.float64]:
    return recording.payload.T_imu_lidar_matrix()[:3, :3]


def stall_warnings(spin: Spin) -> list[str]:
    """Return a sentence on the stalls of the head, if there are any."""
    if not spin.stalls:
        return []
    longest = max(spin.stalls, key=lambda stall: stall[1])
    return [
        f"the head stalls {len(spin.stalls)} time(s), longest {longest[1]:.1f} s from "
        f"{longest[0]:.1f} s on; only the IMU carries the estimate there, check the drive"
    ]
