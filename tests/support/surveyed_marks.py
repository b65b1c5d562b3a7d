# SPDX-License-Identifier: MIT OR Apache-2.0
"""Marks of a simulated world: where a surveyor has measured them, and where somebody sees them in a map."""

from __future__ import annotations

import json
from dataclasses import dataclass

import laspy
import numpy as np
import yaml

from bentwing.base import geometry
from bentwing.base.geodesy import LevelFrame, ProjectedSystem
from bentwing.base.trajectory import read_tum
from bentwing.evaluate.alignment import align
from bentwing.evaluate.simulated import Truth
from bentwing.map.read_mesh import read_mesh

FLAT = 0.12  # m, of the surface around a mark
APART = 2.5  # m, between marks


@dataclass(frozen=True)
class SiteGrid:
    """Coordinates that a site has for itself: of the simulated world, turned about z and shifted."""

    turn: float = np.radians(30.0)
    shift: tuple[float, float, float] = (4500.0, 5500.0, 120.0)

    @property
    def R(self):
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    def of(self, world):
        return world @ self.R.T + self.shift

    def to_world(self, grid):
        return (grid - self.shift) @ self.R


@dataclass(frozen=True)
class OnEarth:
    """Coordinates of a projected system, of the simulated world of a recording with a receiver."""

    folder: object
    epsg: int

    @property
    def _frame(self):
        where = yaml.safe_load((self.folder / "truth_georeference.yaml").read_text())
        frame = LevelFrame(where["longitude"], where["latitude"], where["height"])
        return (
            frame,
            SiteGrid(where["heading"], (0.0, 0.0, 0.0)),
            ProjectedSystem.of_epsg(self.epsg),
        )

    def of(self, world):
        frame, grid, system = self._frame
        return system.from_geodetic(frame.to_geodetic(grid.of(world)))

    def to_world(self, projected):
        frame, grid, system = self._frame
        return grid.to_world(frame.from_geodetic(system.to_geodetic(projected)))


@dataclass
class Seen:
    """A map in a frame of its own, and the true world: x_map = R x_world + t."""

    folder: object  # of the recording
    run: object

    def __post_init__(self):
        start = json.loads((self.run / "run.json").read_text())["start_ns"]
        self.truth, _ = read_tum(self.folder / "truth_trajectory.txt", start)
        found, _ = read_tum(self.run / "trajectory.txt", start)
        times = found.times[self.truth.covers(found.times)]
        placed = align(self.truth.interpolate(times)[0], found.interpolate(times)[0])
        self.R, self.t = placed.R, placed.t

    def in_map(self, world):
        return world @ self.R.T + self.t

    def under_the_head(self, time, foot):
        """Where in the world the foot of the carrier was."""
        p, q = self.truth.interpolate(np.array([time]))
        return p[0] + geometry.rotate(q, np.array([foot]))[0]

    def places(self, rng, are_floors):
        """Places (K, 3) in the world on flat floors and walls that the map has, some metres apart."""
        world = (np.array(laspy.read(self.run / "map.laz").xyz)[::20] - self.t) @ self.R
        return flat_places(self.folder, world, rng, are_floors)


def flat_places(folder, world, rng, are_floors):
    """Places (K, 3) on flat floors and walls near points (N, 3) of a map, some metres apart, in the simulated world."""
    mesh = read_mesh(folder / "truth_scene.ply")
    corners = mesh.vertices[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1), 1e-12)[:, None]
    off, faces = Truth(folder).scene.distance(np.ascontiguousarray(world))
    found = []
    for is_floor in are_floors:
        for i in rng.permutation(len(world)):
            normal, point = normals[faces[i]], world[i] - off[i] * normals[faces[i]]
            is_level = abs(normal[2]) > 0.99 and point[2] < 0.1
            if not (is_level if is_floor else abs(normal[2]) < 0.05):
                continue
            gaps = world - point
            near = np.linalg.norm(gaps, axis=1) < 0.35
            is_flat = near.sum() > 60 and np.ptp(gaps[near] @ normal) < FLAT
            if is_flat and all(np.linalg.norm(point - other) > APART for other in found):
                found.append(point)
                break
    return np.array(found)


def write_marks(path, marks, *, separator=",", decimal="."):
    """Write marks, a dict of columns each."""
    columns = list(dict.fromkeys(key for mark in marks for key in mark))
    lines = [separator.join(columns)]
    for mark in marks:
        cells = [mark.get(column, "") for column in columns]
        texts = [c if isinstance(c, str) else f"{c:.4f}".replace(".", decimal) for c in cells]
        lines.append(separator.join(texts))
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
