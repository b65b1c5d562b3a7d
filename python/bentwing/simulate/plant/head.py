# SPDX-License-Identifier: MIT OR Apache-2.0
"""Torque on the vanes and how the head turns under it, for many flights at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.simulate.plant.airflow import Air, downdraft
from bentwing.simulate.plant.parameters import AIR_DENSITY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.plant.parameters import PlantSettings, Vanes

    Array = NDArray[np.float64]


def driving_force(vanes: Vanes, angle: Array, along: Array, down: Array) -> Array:
    """Force along the circle on the vanes of one arm, N.

    Flat plates over the full range of angles of attack: normal force
    `C = C_max s / (k + (1 − k) |s|)`, s the sine of the angle of attack, k = C_max / slope
    (Hoerner's plate with the slope of a finite one), and the drag of a cup-shaped frame.

    Parameters
    ----------
    angle : rad, of the plates against the vertical; positive turns the downdraft into drive
    along, down : m/s, air relative to the vanes, along the circle (with the spin) and downwards
    """
    squared = along**2 + down**2
    speed = np.sqrt(np.maximum(squared, 1e-12))
    cos, sin = np.cos(angle), np.sin(angle)
    attack = (along * cos + down * sin) / speed
    k = vanes.normal_most / vanes.normal_slope
    normal = vanes.normal_most * attack / (k + (1.0 - k) * np.abs(attack))
    chordwise = vanes.friction * (down * cos - along * sin) / speed
    # Blades behind each other: how much of them the flow meets depends on where it comes from.
    met = vanes.area * (vanes.exposure + (1.0 - vanes.exposure) * down**2 / speed**2)
    plates = met * squared * (normal * cos - chordwise * sin)
    drag = np.where(along > 0, vanes.frame_drag_back, vanes.frame_drag_nose)
    frame = vanes.frame_area * drag * along * np.abs(along)
    return np.asarray(0.5 * AIR_DENSITY * (plates + frame))


class SpunHead:
    """State of N spun heads: `angle` and `rate` of the first arm (N,), `vanes` (N,) rad.

    Parameters
    ----------
    angles : (N,) rad, where the first arms stand
    separations : (N,) rad, from the first to the second arm; default: as in the settings
    """

    def __init__(
        self, settings: PlantSettings, angles: Array, separations: Array | None = None
    ) -> None:
        self._settings = settings
        self.angle = np.array(angles, np.float64)
        self.rate = np.zeros_like(self.angle)
        self.vanes = np.zeros_like(self.angle)
        apart = np.full_like(self.angle, settings.arm_separation)
        apart = apart if separations is None else separations
        self._offsets = np.column_stack([np.zeros_like(apart), apart])

    def torque(self, air: Air) -> Array:
        """Aerodynamic torque about the axis (N,), N m."""
        settings = self._settings
        arm = settings.head.arm
        azimuths = self.angle[:, None] + self._offsets
        radial = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=-1)
        down = downdraft(settings.carrier, settings.flow, air, arm * radial)
        tangent_wind = air.wind[:, None, 1] * radial[..., 0] - air.wind[:, None, 0] * radial[..., 1]
        along = tangent_wind - arm * self.rate[:, None]
        forces = driving_force(settings.vanes, self.vanes[:, None], along, down)
        return np.asarray(arm * forces.sum(axis=1))

    def step(self, air: Air, commands: Array, dt: float) -> None:
        """Go on by `dt` s with vane angles commanded (N,), rad."""
        head = self._settings.head
        self._turn_vanes(commands, dt)
        moved = self.rate + dt / head.inertia * self.torque(air)
        # Dry friction takes away at most the motion itself, so that a head can stick.
        held = head.friction * np.where(self.rate == 0.0, head.breakaway, 1.0) * dt / head.inertia
        self.rate = np.sign(moved) * np.maximum(np.abs(moved) - held, 0.0)
        self.angle = self.angle + dt * self.rate

    def _turn_vanes(self, commands: Array, dt: float) -> None:
        head = self._settings.head
        wanted = (commands - self.vanes) * (dt / (head.servo_lag + dt))
        most = head.servo_rate * dt
        self.vanes = self.vanes + np.clip(wanted, -most, most)
