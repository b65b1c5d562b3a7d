# SPDX-License-Identifier: MIT OR Apache-2.0
"""Whether the gyro or the ranges have a wrong scale: one with which what is seen fits together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.calibrate.set_up.errors import DefectError

if TYPE_CHECKING:
    from collections.abc import Callable

    from bentwing.calibrate.set_up.trial import Trial

    Tried = Callable[[float], Trial]

# With a gyro that is off by half a step a description is still promising.
GYRO_STEP, GYRO_STEPS, FURTHER = 0.06, 14, 7
RANGE_STEP, RANGE_STEPS, FINE = 0.1, 5, 0.03
SMALL = 0.04  # what is less the estimator corrects, or is no mistake of a unit
SUSPICIOUS = 2.0  # times their noise; forces that are so far off may have a cause
CLEARLY = 0.5  # of what forces are off; a scale that leaves more explains nothing


def require_scale_of_gyro(glanced: Tried, tried: Tried) -> None:
    """Refuse a gyro with a scale, if with one what is seen fits together.

    Parameters
    ----------
    glanced, tried : trials of a description with rates that are divided by a scale, short and longer

    Raises
    ------
    DefectError
    """
    steps = sorted(range(-GYRO_STEPS, GYRO_STEPS + 1), key=abs)[1:]
    scales = np.exp(GYRO_STEP * np.array(steps))
    first = next((float(scale) for scale in scales if glanced(float(scale)).is_promising), None)
    if first is None:
        return
    # The first that fits is on the near side of the best one.
    further = first * np.exp(np.sign(np.log(first)) * GYRO_STEP * np.arange(FURTHER))
    least, best = min((_misfit(tried(float(scale))), float(scale)) for scale in further)
    best, _ = _best(best, FINE, lambda scale: _misfit(tried(scale)), least)
    msg = f"the gyro shows about {best:.2f} times the turn that the lidar sees; correct its scale in the driver"
    raise DefectError(msg)


def require_scale_of_ranges(tried: Tried) -> None:
    """Refuse ranges with a scale, if only one explains the forces.

    The lidar's path is as long as its ranges, but the accelerometer knows how long it is.

    Parameters
    ----------
    tried : the trial of a description with ranges that are divided by a scale

    Raises
    ------
    DefectError
    """
    off = _force(tried(1.0))
    if not SUSPICIOUS <= off < np.inf:
        return
    # A scale that is far off may end in another solution, so that the way down is not even.
    scales = np.exp(RANGE_STEP * np.arange(-RANGE_STEPS, RANGE_STEPS + 1)).tolist()
    least, best = min((_force(tried(scale)), scale) for scale in scales)
    best, least = _best(best, FINE, lambda scale: _force(tried(scale)), least)
    if least > CLEARLY * off or abs(np.log(best)) < SMALL or not tried(best).is_promising:
        return
    msg = (
        f"the lidar's ranges are about {best:.2f} times as long as the accelerometer says that it has "
        f"moved: correct their unit or scale in the driver, or write lidar: {{range_scale: {1 / best:.2f}}}"
    )
    raise DefectError(msg)


def _misfit(trial: Trial) -> float:
    last = trial.last
    return np.inf if last is None or last.residual_rms is None else last.residual_rms


def _force(trial: Trial) -> float:
    last = trial.last
    return np.inf if last is None or last.accel_rms is None else last.accel_rms


def _best(
    start: float, step: float, cost: Callable[[float], float], least: float
) -> tuple[float, float]:
    """Return where a cost has its minimum, in relative steps from a start, and the cost there."""
    best = start
    for way in (step, -step):
        while (value := cost(best * np.exp(way))) < least:
            best, least = float(best * np.exp(way)), value
        if best != start:
            break
    return best, least
