# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kaul 2015, section 3: a Hokuyo and an IMU on a payload that the downdraft spins.

The spin axis is the carrier's vertical. The scan plane contains the vertical, its centre beam
looks down, and the blind 90° look up to the airframe (figure 4b).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.airframe import quadrotor
from bentwing.simulate.heads.joints import Mount, Turn
from bentwing.simulate.lidars.hokuyo import Hokuyo
from bentwing.simulate.lidars.interface import described_lidar
from bentwing.simulate.rig import Head

if TYPE_CHECKING:
    from bentwing.simulate.splines import Spline

DOWN_LOOKING = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""R_imu_lidar: the lidar's x (centre beam) down, its y along y."""

SELF_HITS = {"box": {"min": [-0.3, -0.62, -0.62], "max": [0.32, 0.62, 0.62]}}


def hokuyo_spin(
    rng: np.random.Generator, spin: Spline, max_range: float, doubt: float = 1.0
) -> Head:
    """Build the bentwing payload, turned by `spin` about the carrier's z; `doubt` scales what is wrong."""
    lidar = Hokuyo(max_range=max_range)
    T_spin_imu = Mount(np.eye(3), np.array([0.02, -0.01, -0.16]))
    nominal = Mount(DOWN_LOOKING, np.array([0.06, 0.01, 0.04]))
    true = nominal.perturbed(rng, doubt * np.radians(0.5), doubt * 0.004)
    return Head(
        to_imu=[Turn(np.array([0.0, 0.0, 1.0]), spin), T_spin_imu],
        to_lidar=[true],
        airframe=quadrotor(),
        lidar=lidar,
        payload={
            "lidar": described_lidar(lidar, "hokuyo-utm30lx", min_range=0.3),
            "T_imu_lidar": nominal.as_dict(),
            "self_hits": [SELF_HITS],
        },
        truth={"T_imu_lidar": true.as_dict()},
    )
