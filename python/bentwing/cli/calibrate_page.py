# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page that `bentwing calibrate` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from bentwing.calibrate import Calibrated

# name in `std`: what it is, unit, and how many of the unit are one in SI
ROWS = {
    "motor_tilt": ("lidar on the motor, angles across the axis", "°", 180 / np.pi),
    "motor_offset": ("lidar on the motor, shifts across the axis", "mm", 1e3),
    "encoder_delay": ("encoder against lidar", "ms", 1e3),
    "latency": ("lidar against IMU", "ms", 1e3),
    "extrinsic_rotation": ("lidar or motor on the IMU, angles", "°", 180 / np.pi),
    "extrinsic_translation": ("lidar or motor on the IMU, shifts", "mm", 1e3),
    "encoder_zero": ("zero of the encoder", "°", 180 / np.pi),
    "encoder_eccentricity": ("eccentricity of the encoder", "°", 180 / np.pi),
    "motor_wobble": ("wobble of the motor's shaft", "°", 180 / np.pi),
    "range_offset": ("ranges too long", "mm", 1e3),
    "range_grazing": ("ranges too long under 45°", "mm per m", 1e3),
}


def page(found: Calibrated) -> Iterator[RenderableType]:
    """Yield the parts of the page, top to bottom."""
    table = Table("", "correction", "standard deviation", "")
    changes = _changes(found)
    for name, (what, unit, factor) in ROWS.items():
        if (std := found.record.std.get(name)) is not None:
            change = ", ".join(f"{factor * c:.4g}" for c in changes.get(name, ()))
            table.add_row(what, change, ", ".join(f"{factor * s:.2g}" for s in std), unit)
    yield table
    if (motor := found.motor) is not None:
        turns = sum(s.n_turns for s in found.stretches)
        before, after = 1e3 * motor.residual_rms
        yield (
            f"{turns} revolution{'s' if turns > 1 else ''} at rest, {motor.n_pairs} pairs of planes: the "
            f"points are {after:.1f} mm from them, {before:.1f} mm before"
        )
    for sentence in found.record.not_observable:
        yield f"not observable: {sentence}"
    for sentence in found.warnings:
        yield f"warning: {sentence}"


def _changes(found: Calibrated) -> dict[str, list[float]]:
    """Return by how much was found to be different, where that is a number."""
    changes: dict[str, list[float]] = {}
    if (motor := found.motor) is not None:
        changes |= {
            "motor_tilt": motor.correction[:2].tolist(),
            "motor_offset": motor.correction[2:].tolist(),
            "encoder_delay": [motor.delay],
        }
    if found.motion is not None:
        changes["latency"] = [found.motion.source_latency]
    return changes
