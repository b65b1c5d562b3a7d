# SPDX-License-Identifier: MIT OR Apache-2.0
"""The set-up of a 2D lidar: descriptions are tried until what is seen fits together.

A 2D lidar cannot be followed by itself, but with the IMU it can be, and only with the right mount,
axes and delay do the surfaces of its turns agree.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from bentwing.base.mount import FixedMount
from bentwing.calibrate.set_up import axes, edits
from bentwing.calibrate.set_up.noise import ImuNoise
from bentwing.calibrate.set_up.returns import NEARBY, delays_by_returns
from bentwing.calibrate.set_up.rotations import cover
from bentwing.calibrate.set_up.spatial import NotFoundError
from bentwing.calibrate.set_up.trial import try_payload
from bentwing.recording import imu_units

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.calibrate.set_up.trial import Trial
    from bentwing.recording import ImuBatch, Payload

TRIED, GLANCE = 6.0, 2.5  # s of the richest motion on which descriptions are tried, and first seen
LONG_GLANCE = 4.5  # s, of a head that turns little
# Rotations in the middle between those of a cover.
ASIDE = Rotation.from_rotvec(np.radians(36.0) * np.array([0.0, 0.6, 0.8]))
AS_DESCRIBED = 0.02  # rad, std of a rotation that may hold
CLOSE = 0.2  # rad, std of a rotation that is described
WIDE = 0.5  # rad, std of a rotation that is one of a cover
UNKNOWN_LATENCY = 0.02  # s, std once it was found
UNKNOWN_SHIFT = 0.1  # m, std where no mount is described
# The axes of the samples hold where others explain how gravity turns hardly better.
AS_GOOD = 1.3
SECOND_GLANCES = 8
_POINT = (
    "either the lidar is mounted with half a turn about the normal of its scan plane, or all axes of the "
    "accelerometer are negated; a 2D lidar sees both alike: turn T_imu_lidar, or write imu: "
    "{axes: [-x, -y, -z], gyro_axes: [x, y, z]}"
)
_PLANE = (
    "either all axes of the gyro are negated, or the axis of the IMU across the scan plane of the lidar "
    "is; a 2D lidar sees both alike: write imu: {gyro_axes: [-x, -y, -z]}, or that axis negated in imu: "
    "{axes: [x, y, z]}"
)


def describe_by_trials(
    stretch: Stretch, payload: Payload, given: Payload | None, *, threads: int | None
) -> Payload:
    """Return the payload with which what the lidar sees fits together.

    Parameters
    ----------
    stretch : as drivers give it
    payload : that says nothing of axes and latency
    given : the payload as it was given, None where that one describes no mount

    Raises
    ------
    NotFoundError
        None of the descriptions does, or two of them do.
    """
    imu = stretch.read_as(payload).imu
    trials = _Trials(stretch, ImuNoise.of(imu), threads)
    if given is not None and (found := trials.consistent(given, rotation=AS_DESCRIBED)):
        return found
    seen = delays_by_returns(stretch, imu)
    # The clocks may well agree, whatever the returns seem to say.
    delays = seen if any(abs(delay) < NEARBY for delay in seen) else [0.0, *seen]
    ranked = _ranked_axes(imu)
    if given is not None:
        for delay, rotation in itertools.product(delays, (AS_DESCRIBED, CLOSE)):
            described = edits.with_latency(payload, delay)
            if (found := trials.consistent(described, rotation=rotation)) is not None:
                return found
        likely = edits.with_latency(payload, delays[0])
        if (found := trials.with_other_axes(likely, ranked)) is not None:
            return found
    centre = None if given is None else edits.described_rotation(payload)
    # A head that nods in time with itself agrees with other delays as well: only the best is tried.
    described = edits.with_axes(edits.with_latency(payload, delays[0]), ranked[0], np.eye(3))
    middle = Rotation.identity() if centre is None else Rotation.from_matrix(centre)
    for length, aside in ((GLANCE, Rotation.identity()), (LONG_GLANCE, ASIDE)):
        if (found := trials.searched(described, middle * aside, length)) is not None:
            return found
    raise NotFoundError(trials.failure)


class _Trials:
    """Tries descriptions on the richest part of a stretch."""

    def __init__(self, stretch: Stretch, noise: ImuNoise, threads: int | None) -> None:
        self._stretch, self._noise, self._threads = stretch, noise, threads
        self._best: Trial | None = None

    def consistent(self, payload: Payload, *, rotation: float) -> Payload | None:
        """Return what a description has become if all fits together with it."""
        trial = self._tried(payload, rotation, TRIED)
        return _learned(payload, trial) if trial.is_consistent else None

    def searched(self, payload: Payload, centre: Rotation, length: float) -> Payload | None:
        """Look for the rotation of the lidar anywhere, nearest to `centre` first, by glances of a length, s."""
        glances = []
        for rotation in cover(centre):
            turned = edits.with_rotation(payload, rotation.as_matrix())
            glance = self._tried(turned, WIDE, length)
            if glance.is_promising and (found := self._confirmed(payload, glance)) is not None:
                return found
            glances.append(glance)
        glances = [glance for glance in glances if not glance.is_promising]
        glances.sort(key=lambda glance: -glance.score)
        confirmed = (self._confirmed(payload, glance) for glance in glances[:SECOND_GLANCES])
        return next((found for found in confirmed if found is not None), None)

    def with_other_axes(
        self, payload: Payload, ranked: Sequence[NDArray[np.float64]]
    ) -> Payload | None:
        """Look for other axes of the gyro or of the accelerometer, then of both.

        Raises
        ------
        NotFoundError
            A 2D lidar sees the same with another mistake.
        """
        for gyro, accel in [*_of_one_sensor(ranked), *_of_both_sensors(ranked)]:
            described = edits.with_axes(payload, gyro, accel)
            glance = self._tried(described, CLOSE, GLANCE)
            if glance.is_promising and (found := self._confirmed(described, glance)) is not None:
                _require_one_meaning(gyro, accel)
                return found
        return None

    def _confirmed(self, payload: Payload, glance: Trial) -> Payload | None:
        """Return what a glance has learned if all fits together with it."""
        if glance.calibration is None:
            return None
        # What it saw first was blurred by where it came from.
        return self.consistent(_learned(payload, glance), rotation=CLOSE)

    @property
    def failure(self) -> str:
        """Say how well the best description did."""
        return "nothing that can be seen" if self._best is None else self._best.sentence

    def _tried(self, payload: Payload, rotation: float, length: float) -> Trial:
        wide = edits.with_std(
            self._noise.at_least_in(payload),
            extrinsic_rotation=rotation,
            extrinsic_translation=UNKNOWN_SHIFT if rotation > AS_DESCRIBED else 0.0,
            latency=UNKNOWN_LATENCY,
        )
        read = self._stretch.read_as(wide)
        start, _ = richest(read.imu, TRIED)
        trial = try_payload(read.part(start, start + length), wide, self._threads)
        if self._best is None or trial.score > self._best.score:
            self._best = trial
        return trial


def _learned(payload: Payload, trial: Trial) -> Payload:
    """Return a payload with the rotation and the delay that a trial came to."""
    assert trial.calibration is not None
    mount = trial.calibration.mount
    base = mount.T_imu_lidar if isinstance(mount, FixedMount) else mount.T_imu_motor
    rotated = edits.with_rotation(payload, base.R)
    return edits.with_latency(rotated, trial.calibration.source_latency)


def _require_one_meaning(gyro: NDArray[np.float64], accel: NDArray[np.float64]) -> None:
    """Refuse axes with which a 2D lidar sees the mirror image of another set-up.

    A plane is its own mirror image. So a world that is mirrored at a point looks the same to a scanner
    that is turned by half a turn about the normal of its scans, and one that is mirrored at the plane to
    the scanner as it is; the IMU feels a negated force in the one, and a negated turn in the other.
    """
    if np.array_equal(accel, -np.eye(3)) and np.array_equal(gyro, np.eye(3)):
        raise NotFoundError(_POINT)
    if np.array_equal(gyro, -np.eye(3)) and np.array_equal(accel, np.eye(3)):
        raise NotFoundError(_PLANE)


def richest(imu: ImuBatch, length: float) -> tuple[float, float]:
    """Return start and end, s, of the part in which the head turns most."""
    steps = np.linalg.norm(imu.gyro[1:], axis=1) * np.diff(imu.times)
    turned = np.concatenate([[0.0], np.cumsum(steps)])
    starts = np.arange(imu.times[0], max(imu.times[-1] - length, imu.times[0]) + 0.1, 0.5)
    ahead = np.interp(starts + length, imu.times, turned) - np.interp(starts, imu.times, turned)
    start = float(starts[int(np.argmax(ahead))])
    return start, start + length


def _ranked_axes(imu: ImuBatch) -> list[NDArray[np.float64]]:
    """Return axes (3, 3) of the gyro relative to the accelerometer's, the likeliest first.

    Where gravity turns enough in the samples it ranks them, else the fewer mistakes the likelier.
    """
    windows = imu_units.GravityWindows(imu.times, imu.gyro, imu.accel)
    rated = [(windows.residual(1.0, P), P) for P in axes.signed_permutations()]
    plain, least = rated[0][0], min(residual for residual, _ in rated)
    if plain <= AS_GOOD * least or least > imu_units.EXPLAINS * windows.at_rest:
        return sorted((P for _, P in rated), key=_n_mistakes)
    return [P for _, P in sorted(rated, key=lambda pair: pair[0])]


def _n_mistakes(P: NDArray[np.float64]) -> int:
    """Return how many axes are other than those of the samples; all negated are one mistake."""
    return min(int((np.diag(P) != 1.0).sum()), 1 + int((np.diag(P) != -1.0).sum()))


def _of_one_sensor(
    relative: Sequence[NDArray[np.float64]],
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield axes of gyro and accelerometer of which one is to blame."""
    plain = np.eye(3)
    for P in relative:
        if not np.array_equal(P, plain):
            yield P, plain
            yield plain, P.T


def _of_both_sensors(
    relative: Sequence[NDArray[np.float64]],
) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Yield left-handed axes of the whole IMU; right-handed ones are another mount."""
    return ((P, P) for P in relative if np.linalg.det(P) < 0.0)
