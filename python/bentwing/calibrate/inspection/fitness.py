# SPDX-License-Identifier: MIT OR Apache-2.0
"""Judge what was read of a recording: what prevents mapping, and what may make the map worse."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.inspection.planar import MIN_CORRELATION, level_share
from bentwing.recording import imu_units, problems
from bentwing.recording.messages.lidar_messages import is_planar
from bentwing.recording.preprocess import find_static_start

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from bentwing.calibrate.inspection.planar import ScanTurns
    from bentwing.calibrate.inspection.spin import Spin
    from bentwing.recording.batches import EncoderBatch, ImuBatch
    from bentwing.recording.recording import Recording

Stretch = tuple[float, float]
MIN_IMU_RATE_HZ = 90.0
JUDGED = 60.0  # s of IMU samples; more would not change the judgement of their units
ALWAYS_LEVEL = 0.95  # share of time


@dataclass(frozen=True, slots=True)
class Samples:
    """The small streams of a recording, whole: IMU (M,), (M, 3), (M, 3); encoder (K,), (K,)."""

    imu_times: NDArray[np.float64]
    gyro: NDArray[np.float64]
    accel: NDArray[np.float64]
    encoder_times: NDArray[np.float64]
    encoder_angles: NDArray[np.float64]
    scan_turns: ScanTurns | None

    @classmethod
    def joined(
        cls,
        imu: Sequence[ImuBatch],
        encoder: Sequence[EncoderBatch],
        scan_turns: ScanTurns | None,
    ) -> Samples:
        """Return the batches of a whole recording as one."""
        empty, empty3 = np.zeros(0), np.zeros((0, 3))
        return cls(
            np.concatenate([empty, *(batch.times for batch in imu)]),
            np.concatenate([empty3, *(batch.gyro for batch in imu)]),
            np.concatenate([empty3, *(batch.accel for batch in imu)]),
            np.concatenate([empty, *(batch.times for batch in encoder)]),
            np.concatenate([empty, *(batch.angles for batch in encoder)]),
            scan_turns,
        )


@dataclass(frozen=True, slots=True)
class Judgement:
    """What was found.

    Attributes
    ----------
    defects, warnings : what prevents mapping, what may make the map worse
    static_start : (start, end) s, if any
    gyro : (M, 3) rad/s, imu frame, repaired where its unit is certainly wrong
    """

    defects: list[str]
    warnings: list[str]
    static_start: Stretch | None
    gyro: NDArray[np.float64]


def judge(recording: Recording, samples: Samples, *, has_payload: bool) -> Judgement:
    """Judge a recording by the samples of one pass; defects say how to repair them."""
    defects = _time_defects(recording) + recording.clock_problems()
    warnings: list[str] = []
    static, gyro = None, samples.gyro
    if len(samples.imu_times):
        n = int(np.searchsorted(samples.imu_times, samples.imu_times[0] + JUDGED))
        judged = samples.imu_times[:n], samples.gyro[:n], samples.accel[:n]
        defects += [f"{recording.imu_topic}: {text}" for text in imu_units.problems(*judged)]
        gyro = gyro * imu_units.gyro_scale(*judged)
        defects += _mirrored(recording, samples, gyro)
        start = find_static_start(judged[0], *imu_units.in_si(*judged))
        static = None if start is None else (start.start, start.end)
        warnings += _imu_rate(recording, samples) + _start_warnings(static)
        if (mirrored := imu_units.mirrored_axis(judged[0], *imu_units.in_si(*judged))) is not None:
            warnings.append(f"{recording.imu_topic}: {mirrored}")
    planar = _planar_defects(recording, samples)
    if planar and not has_payload and not _scans_turn(recording, samples, gyro):
        planar, warnings = [], [*warnings, _unknown_plane(recording)]
    defects += planar
    defects += _mount_defects(recording, has_payload=has_payload)
    return Judgement(defects, warnings, static, gyro)


def _start_warnings(static: Stretch | None) -> list[str]:
    if static is not None:
        return []
    return [
        "no static start: the recording begins in motion or the gyro has a large bias at rest; let "
        "the head rest for some seconds before it moves, it makes the first seconds better"
    ]


def _time_defects(recording: Recording) -> list[str]:
    return (
        []
        if recording.point_times
        else [problems.point_times(recording.lidar_topic, recording.lidar_type)]
    )


def _mirrored(recording: Recording, samples: Samples, gyro: NDArray[np.float64]) -> list[str]:
    """Compare the turn of a level 2D lidar from scan to scan with the gyro about its normal."""
    agreement = _scan_agreement(recording, samples, gyro)
    if agreement is None or agreement > -MIN_CORRELATION:
        return []
    return [
        f"{recording.imu_topic}: the gyro turns against the scans of {recording.lidar_topic} about "
        "the scan plane's normal, so one axis is mirrored; flip the sign of the gyro's axis along "
        "the normal in the driver, or, if the lidar is mounted upside down, say so in T_imu_lidar"
    ]


def _scan_agreement(
    recording: Recording, samples: Samples, gyro: NDArray[np.float64]
) -> float | None:
    if samples.scan_turns is None:
        return None
    rates = gyro @ _R_imu_lidar(recording)[:, 2]
    return samples.scan_turns.agreement(samples.imu_times, rates - np.median(rates))


def _imu_rate(recording: Recording, samples: Samples) -> list[str]:
    rate_hz = 1.0 / max(float(np.median(np.diff(samples.imu_times))), 1e-9)
    if len(samples.imu_times) < 2 or rate_hz >= MIN_IMU_RATE_HZ:
        return []
    return [
        f"{recording.imu_topic}: {rate_hz:.0f} Hz is slow for a moving lidar; set the IMU to 100 "
        "Hz or more"
    ]


def _planar_defects(recording: Recording, samples: Samples) -> list[str]:
    """Return why a 2D lidar cannot make a 3D map, if it cannot."""
    if not is_planar(recording.lidar_type) or recording.encoder_topic is not None:
        return []
    if not len(samples.imu_times):
        return [
            f"{recording.lidar_topic}: a 2D lidar without IMU and encoder; nothing tells how its "
            "scan plane moves, record one of them too"
        ]
    half = max(1, int(0.25 / max(float(np.median(np.diff(samples.imu_times))), 1e-6)))
    kernel = np.ones(2 * half + 1)
    smooth = np.column_stack([np.convolve(axis, kernel, "same") for axis in samples.accel.T])
    if level_share(smooth, _R_imu_lidar(recording)) < ALWAYS_LEVEL:
        return []
    return [
        f"{recording.lidar_topic}: a 2D lidar whose scan plane stays level sees one slice of the "
        "surroundings and cannot make a 3D map; spin or nod the lidar, or use a 2D SLAM program"
    ]


def _scans_turn(recording: Recording, samples: Samples, gyro: NDArray[np.float64]) -> bool:
    """Whether the scans turn with or against the gyro, which a level plane does in any mount."""
    if not len(samples.imu_times):
        return True
    agreement = _scan_agreement(recording, samples, gyro)
    return agreement is not None and abs(agreement) >= MIN_CORRELATION


def _unknown_plane(recording: Recording) -> str:
    return (
        f"{recording.lidar_topic}: whether the scan plane sweeps space cannot be told without "
        "knowing how the lidar is mounted; give the payload.yaml with --payload"
    )


def _mount_defects(recording: Recording, *, has_payload: bool) -> list[str]:
    if recording.imu_topic is None or recording.payload.places_lidar_on_imu or not has_payload:
        return []
    return [problems.mount(recording.imu_topic)]


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
