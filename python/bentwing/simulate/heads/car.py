# SPDX-License-Identifier: MIT OR Apache-2.0
"""A lidar of many beams on the roof of a car, level, 1.75 m above the road."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.heads.joints import Mount
from bentwing.simulate.lidars.interface import described_lidar
from bentwing.simulate.rig import Head
from bentwing.simulate.scenes.mesh import box, merge

if TYPE_CHECKING:
    from bentwing.simulate.lidars.rotating import Rotating

T_BODY_IMU = Mount(np.eye(3), np.array([0.05, -0.3, 0.35]))
NOMINAL = Mount(np.eye(3), np.array([-0.05, 0.3, 0.85]))
ROOF = ((-1.2, -0.6, 0.75), (0.5, 0.6, 0.9))
"""Corners of the roof, m, body frame."""
SELF_HITS = {"box": {"min": [-1.5, -0.9, -0.6], "max": [0.9, 0.9, -0.2]}}


def car_head(rng: np.random.Generator, lidar: Rotating, kind: str, doubt: float) -> Head:
    """Build the head; `doubt` scales what is wrong."""
    true = NOMINAL
    if doubt:
        true = NOMINAL.perturbed(rng, doubt * np.radians(0.5), doubt * 0.01)
    payload = {
        "lidar": described_lidar(lidar, kind, min_range=1.0),
        "T_imu_lidar": NOMINAL.as_dict(),
        "self_hits": [SELF_HITS],
    }
    truth = {"T_imu_lidar": true.as_dict()}
    return Head([T_BODY_IMU], [true], merge([box(*ROOF)]), lidar, payload, truth)
