# SPDX-License-Identifier: MIT OR Apache-2.0
"""What can go wrong during a recording, by name."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from bentwing._core import Scene
from bentwing.simulate.ranging import incidence
from bentwing.simulate.records import CloudRecord, Record, ScanRecord
from bentwing.simulate.scenes.mesh import ball, box, column, merge
from bentwing.simulate.scenes.world import World, face_normals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.simulate.beams import Beams
    from bentwing.simulate.imu import ImuErrors

    Array = NDArray[np.float64]

STALL = 4.0
"""s, how long the head does not turn where nothing else is asked for."""
GAP = 1.5
"""s, how long nothing is recorded."""
LEAD = 14.0
"""s, how much of the motion is over when a recording starts in motion."""
WALK_SPEED = 1.1
BURST_CHANCE = 0.01


def turning(times: Array, duration: float, stall: float = STALL) -> Array:
    """Share of the head's drive (N,): zero for `stall` seconds from the middle on, else one."""
    off = 0.55 * duration
    return np.where((times > off) & (times < off + stall), 0.0, 1.0)


def reversing(times: Array, duration: float) -> Array:
    """Direction of a motor (N,) that turns back in the middle, with half a second of change."""
    return np.asarray(np.clip((0.5 * duration - times) / 0.25, -1.0, 1.0))


def gust_shifts(rng: np.random.Generator, times: Array, start: float, end: float) -> Array:
    """Displacements (N, 3), m, of a carrier pushed about by three gusts."""
    shifts = np.zeros((len(times), 3))
    for at in rng.uniform(start, end, 3):
        heading, size = rng.uniform(0.0, 2 * np.pi), rng.uniform(0.25, 0.45)
        push = size * np.array([np.cos(heading), np.sin(heading), rng.uniform(-0.3, 0.3)])
        shifts += np.exp(-(((times - at) / 0.7) ** 2))[:, None] * push
    return shifts


def strong_bias(errors: ImuErrors) -> ImuErrors:
    """Biases four times as large that walk five times as fast."""
    return replace(
        errors,
        gyro_bias=4 * errors.gyro_bias,
        accel_bias=4 * errors.accel_bias,
        gyro_bias_walk=5 * errors.gyro_bias_walk,
        accel_bias_walk=5 * errors.accel_bias_walk,
    )


class Person:
    """Somebody who walks to and fro under the carrier's way."""

    def __init__(self, world: World, rng: np.random.Generator, near: Array) -> None:
        legs = [box((-0.1, y - 0.08, 0.0), (0.1, y + 0.08, 0.9)) for y in (-0.12, 0.12)]
        trunk = column((0.24, 0.2), 0.65, 10).moved((0.0, 0.0, 0.85))
        body = merge([*legs, trunk, ball([0.12, 0.12, 0.14], 6).moved((0.0, 0.0, 1.64))])
        self._scene = Scene(body.vertices, body.triangles)
        self._normals = face_normals(body)
        self._base, self._way = _free_way(world, rng, near)
        self._length = float(np.linalg.norm(self._way))

    def positions(self, times: Array) -> Array:
        """Where the feet are (N, 3), m, map frame."""
        # A sine has its mean at the middle of the way and its greatest speed there.
        swing = np.sin(2 * WALK_SPEED / max(self._length, 0.5) * times)
        return self._base + 0.5 * swing[:, None] * self._way

    def cast(self, beams: Beams, origins: Array, directions: Array) -> tuple[Array, Array]:
        """Casts in the frame of the person, who does not turn."""
        local = origins - self.positions(beams.times.ravel())
        ranges, faces = self._scene.cast(local, np.ascontiguousarray(directions), 60.0)
        return ranges, incidence(self._normals, faces, directions)


def _free_way(world: World, rng: np.random.Generator, near: Array) -> tuple[Array, Array]:
    """Middle and extent of the longest free line on the ground near a point."""
    ground = near[2] - world.scene.cast(near[None], np.array([[0.0, 0.0, -1.0]]), 200.0)[0][0]
    base = np.array([near[0], near[1], ground])
    best = np.array([0.5, 0.0, 0.0])
    for heading in rng.uniform(0.0, np.pi, 12):
        along = np.array([np.cos(heading), np.sin(heading), 0.0])
        steps = np.arange(0.0, 4.0, 0.2)
        points = base + [0.0, 0.0, 1.0] + np.concatenate([steps, -steps])[:, None] * along
        free = (world.clearance(points) > 0.35).reshape(2, -1).all(axis=0)
        reach = float(steps[np.argmin(free) - 1 if not free.all() else -1])
        if 2 * reach > np.linalg.norm(best):
            best = 2 * reach * along
    return base, best


@dataclass(slots=True)
class Losses:
    """Records that never reach the recording.

    Attributes
    ----------
    gap : s, from when to when nothing is recorded
    bursts : whether lidar messages get lost in bursts, and single inertial ones
    """

    rng: np.random.Generator
    gap: tuple[float, float] | None = None
    bursts: bool = False
    _until: float = field(default=-1.0, init=False)

    def remaining(self, records: list[Record]) -> list[Record]:
        """Return what of `records` (in order of arrival) is recorded."""
        return [record for record in records if not self._is_lost(record)]

    def _is_lost(self, record: Record) -> bool:
        if self.gap and self.gap[0] <= record.arrival < self.gap[1]:
            return True
        if not self.bursts:
            return False
        if isinstance(record, ScanRecord | CloudRecord):
            if self.rng.random() < BURST_CHANCE:
                self._until = record.arrival + float(self.rng.uniform(0.0, 0.15))
            return record.arrival <= self._until
        return bool(self.rng.random() < 0.3 * BURST_CHANCE)
