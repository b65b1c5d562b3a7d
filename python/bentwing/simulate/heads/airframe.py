# SPDX-License-Identifier: MIT OR Apache-2.0
"""The parts of a quadrotor that its own lidar sees."""

from __future__ import annotations

from bentwing.simulate.scenes.mesh import Mesh, box, merge

LEG_LENGTH = 0.40
"""m, height of the body's origin above the ground when standing."""


def quadrotor() -> Mesh:
    """Four legs and four arms, body frame."""
    parts = []
    for i in (-1, 1):
        for j in (-1, 1):
            x, y = 0.28 * i, 0.28 * j
            parts.append(box((x - 0.01, y - 0.01, -LEG_LENGTH), (x + 0.01, y + 0.01, 0.05)))
            inner, outer = sorted((0.1 * i, 0.34 * i)), sorted((0.1 * j, 0.34 * j))
            parts.append(box((inner[0], y - 0.015, 0.04), (inner[1], y + 0.015, 0.07)))
            parts.append(box((x - 0.015, outer[0], 0.04), (x + 0.015, outer[1], 0.07)))
    return merge(parts)
