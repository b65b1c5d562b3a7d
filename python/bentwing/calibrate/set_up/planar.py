# SPDX-License-Identifier: MIT OR Apache-2.0
"""The set-up of a 2D lidar: descriptions that may hold are tried until what is seen fits together.

A 2D lidar cannot be followed by itself, but with the IMU it can be, and only with the right mount,
axes and delay do the surfaces of its turns agree. Where its scans cross shows which may hold.
"""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up import axes, edits
from bentwing.calibrate.set_up.crossings import Crossings, Reading
from bentwing.calibrate.set_up.delays import likely_delays
from bentwing.calibrate.set_up.errors import NotFoundError
from bentwing.calibrate.set_up.mirrors import both_meanings
from bentwing.calibrate.set_up.scans import Scans
from bentwing.calibrate.set_up.trials import Trials
from bentwing.odometry.imu_noise import ImuNoise
from bentwing.recording import imu_units

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from bentwing.calibrate.set_up.stretch import Stretch
    from bentwing.recording import ImuBatch, Payload

# The axes of the samples hold where others explain how gravity turns hardly better.
AS_GOOD = 1.3
LIKELY, LIKELY_UNMOUNTED = 4, 2  # delays that are tried first, and those without a described mount
MAY_HOLD = 0.3  # of the way from the best misfit of crossings to what is usual
# Of the logarithm of a range; where the best mount does no better, the surroundings tell no mount.
TELLING = 0.02
_ALIKE = (
    "what the lidar sees fits together in any mount: record where there are walls and corners within "
    "its reach"
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
    trials = Trials(stretch, ImuNoise.of(imu), has_mount=given is not None, threads=threads)
    if given is not None and (found := trials.as_described(given)):
        return found
    if given is not None:
        trials.require_scale_of_ranges(given)
    scans = Scans(stretch.lidar)
    crossings = Crossings(scans, imu)
    delays = likely_delays(scans, imu, crossings)
    # A head that nods in time with itself agrees with other delays as well: only the best is tried.
    likely = edits.with_latency(payload, delays[0])
    descriptions = _Descriptions(payload, crossings, delays[0], _ranked_axes(imu))
    described = None if given is None else edits.described_rotation(payload)
    delayed = [edits.with_latency(payload, d) for d in descriptions.agreeing(described, delays)]
    if described is not None:
        tries = itertools.product(delayed[:LIKELY], (trials.as_described, trials.about))
        if found := _first(tried(late) for late, tried in tries):
            return found
        for gyro, accel in descriptions.of_axes(described):
            if found := trials.at_a_glance(edits.with_axes(likely, gyro, accel)):
                return _not_mirrored(found, described)
    unmounted = delays[: LIKELY_UNMOUNTED if given is None else 1]
    mounted = itertools.chain(*map(descriptions.of_mounts, unmounted))
    others = itertools.chain(mounted, delayed[LIKELY:])
    if found := _first(trials.at_a_glance(other) for other in others) or trials.least_strained():
        return _not_mirrored(found, described)
    trials.require_scale_in_what_was_refused()
    if given is not None:
        trials.require_scale_of_gyro(given)
    raise NotFoundError(trials.failure)


def _not_mirrored(found: Payload, described: NDArray[np.float64] | None) -> Payload:
    """Return what was found, if no mirror image of it is as likely.

    Raises
    ------
    NotFoundError
        One is.
    """
    R = edits.described_rotation(found)
    if described is None or R is None or found.imu is None:
        return found
    if doubt := both_meanings(*edits.axes_of(found.imu), R, described):
        raise NotFoundError(doubt)
    return found


def _first(found: Iterable[Payload | None]) -> Payload | None:
    return next((payload for payload in found if payload is not None), None)


class _Descriptions:
    """Descriptions that may hold by where the scans cross, the likeliest first.

    Parameters
    ----------
    payload : that says nothing of the delay
    delay : s, the likeliest
    ranked : axes (3, 3) of the gyro relative to the accelerometer's

    Raises
    ------
    NotFoundError
        Any does.
    """

    def __init__(
        self,
        payload: Payload,
        crossings: Crossings,
        delay: float,
        ranked: Sequence[NDArray[np.float64]],
    ) -> None:
        self._payload, self._crossings, self._ranked = payload, crossings, ranked
        self._delay = delay
        hand = round(np.linalg.det(ranked[0]))
        best = crossings.mounts(Reading(delay, hand))[0][0]
        if crossings.usual - best < TELLING:
            raise NotFoundError(_ALIKE)
        self._most = best + MAY_HOLD * (crossings.usual - best)

    def agreeing(self, R: NDArray[np.float64] | None, delays: Sequence[float]) -> list[float]:
        """Return the delays, s, with which a lidar may be mounted by R (3, 3); none without it."""
        if R is None:
            return []
        return [d for d in delays if self._crossings.misfit(R, Reading(d)) <= self._most]

    def of_axes(
        self, R: NDArray[np.float64]
    ) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield axes (3, 3) of gyro and accelerometer for a lidar that is mounted by R (3, 3)."""
        for gyro, accel in [*_of_one_sensor(self._ranked), *_of_both_sensors(self._ranked)]:
            hand = round(np.linalg.det(gyro))
            reading = Reading(self._delay, hand)
            if self._crossings.misfit(hand * gyro.T @ R, reading) <= self._most:
                yield gyro, accel

    def of_mounts(self, delay: float) -> Iterator[Payload]:
        """Yield descriptions with other mounts and a delay, s, and the likeliest axes."""
        gyro = self._ranked[0]
        hand = round(np.linalg.det(gyro))
        delayed = edits.with_latency(self._payload, delay)
        described = edits.with_axes(delayed, gyro, np.eye(3))
        for misfit, R in self._crossings.mounts(Reading(delay, hand)):
            if misfit > self._most:
                break
            yield edits.with_rotation(described, hand * gyro @ R)


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
