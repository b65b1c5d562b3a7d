# SPDX-License-Identifier: MIT OR Apache-2.0
"""Zebedee (Bosse et al. 2012): a Hokuyo and an IMU on a spring, carried by a walking person.

The scan plane is level at rest, its centre beam looks ahead, and the spring nods about the
carrier's left axis; the blind quarter looks back to the person.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.joints import Mount, Turn
from bentwing.simulate.heads.rates import ornstein_uhlenbeck
from bentwing.simulate.lidars.hokuyo import Hokuyo
from bentwing.simulate.lidars.interface import described_lidar
from bentwing.simulate.rig import Head
from bentwing.simulate.scenes.mesh import Mesh, box, merge
from bentwing.simulate.splines import Spline

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

NOD_STEP = 0.05
SELF_HITS = {"box": {"min": [-0.9, -0.5, -0.1], "max": [0.0, 0.5, 0.1]}}


def hokuyo_nod(
    rng: np.random.Generator, drive: Array, max_range: float, doubt: float = 1.0
) -> Head:
    """Build the nodding head; `drive` (0 … 1 at the knots of `NOD_STEP`) shakes the spring, `doubt` scales what is wrong."""
    lidar = Hokuyo(max_range=max_range)
    nominal = Mount(np.eye(3), np.array([0.01, 0.0, 0.06]))
    true = nominal.perturbed(rng, doubt * np.radians(0.5), doubt * 0.004)
    nod, roll = _swing(rng, drive)
    on_spring = Mount(np.eye(3), np.array([0.0, 0.0, 0.12]))
    return Head(
        to_imu=[Turn(np.array([0.0, 1.0, 0.0]), nod), Turn(np.array([1.0, 0, 0]), roll), on_spring],
        to_lidar=[true],
        airframe=_person(),
        lidar=lidar,
        payload={
            "lidar": described_lidar(lidar, "hokuyo-utm30lx", min_range=0.15),
            "T_imu_lidar": nominal.as_dict(),
            "self_hits": [SELF_HITS],
        },
        truth={"T_imu_lidar": true.as_dict()},
    )


def _swing(rng: np.random.Generator, drive: Array) -> tuple[Spline, Spline]:
    """Nodding by about ±50° at about 1 Hz, both irregular, and a smaller sideways swing."""
    n = len(drive)
    frequency = 1.0 + ornstein_uhlenbeck(rng, n, NOD_STEP, 2.0, 0.08)
    amplitude = np.radians(50.0 + ornstein_uhlenbeck(rng, n, NOD_STEP, 1.5, 7.0))
    phase = 2 * np.pi * np.cumsum(frequency) * NOD_STEP
    nod = amplitude.clip(np.radians(30.0), np.radians(65.0)) * np.sin(phase)
    roll = np.radians(6.0) * np.sin(0.5 * phase + 1.0) + np.radians(
        ornstein_uhlenbeck(rng, n, NOD_STEP, 0.5, 2.0)
    )
    nod_spline, roll_spline = (Spline(NOD_STEP, (angle * drive)[:, None]) for angle in (nod, roll))
    return nod_spline, roll_spline


def _person() -> Mesh:
    """Trunk and head behind the scanner, elbows and the hand that holds it, body frame."""
    elbows = [box((-0.34, y - 0.05, -0.35), (-0.22, y + 0.05, -0.05)) for y in (-0.36, 0.36)]
    return merge(
        [
            *elbows,
            box((-0.65, -0.22, -0.9), (-0.38, 0.22, 0.35)),
            box((-0.6, -0.09, 0.35), (-0.42, 0.09, 0.62)),
            box((-0.38, -0.05, -0.2), (-0.03, 0.05, -0.1)),
        ]
    )
