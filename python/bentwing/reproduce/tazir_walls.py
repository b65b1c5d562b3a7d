# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tazir 2020, figures 5, 6 and 11: how densely a lidar that stands still covers two walls."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.trajectory import read_tum
from bentwing.evaluate.density import wall_density
from bentwing.evaluate.simulated import true_calibration
from bentwing.map.project import placed_points
from bentwing.recording import LidarBatch, Payload, Recording
from bentwing.recording.preprocess import preprocess
from bentwing.report.colours import HEIGHT, colour
from bentwing.report.picture import View
from bentwing.report.svg import map_view
from bentwing.reproduce.campaign import Job, steps
from bentwing.reproduce.figure import Figure, TextTable
from bentwing.reproduce.trials import Flight
from bentwing.simulate.scenario import Scenario
from bentwing.simulate.scenes.walls import DISTANCE, HALF, TOP
from bentwing.simulate.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import NDArray

    from bentwing.reproduce.figure import Assignment

    Array = NDArray[np.float64]

_CELL = 0.25  # m, of the drawn densities
_PIXELS = 10  # of a cell
_DECADES = (0.0, 4.0)  # of points per m², at the ends of the colours


def _walls(name: str, rate: float | None) -> Flight:
    head = {"head": "vlp16-side"} if rate is None else {"head": "vlp16-motor", "motor_rate": rate}
    return Flight(name, {"scene": "walls", "calibrated": True, **head}, 15.0, 8.0)


WALLS = (_walls("fixed", None), _walls("0.5 rad/s", 0.5), _walls("1 rad/s", 1.0))


@dataclass(frozen=True, slots=True)
class Covered:
    """Points per m² in cells of `_CELL`: `across` is the wall that the motor's axis meets squarely.

    Attributes
    ----------
    across, along : (A, B), horizontally and upwards
    floor : (A, A)
    """

    across: Array
    along: Array
    floor: Array


def wall_job(flight: Flight, assignment: Assignment) -> Job:
    """Make the job of scanning the walls; it results in a `Covered`."""
    seconds = flight.seconds(quick=assignment.quick)
    return Job(flight.name, seconds, scan_walls, (flight, seconds, assignment.seed))


def scan_walls(
    folder: Path, advance: Callable[[float], None], flight: Flight, seconds: float, seed: int
) -> Covered:
    """Simulate a lidar between the walls and count where its points fall."""
    scenario = Scenario(duration=seconds, seed=seed, **flight.scenario)
    files = simulate(scenario, folder, steps(advance))
    payload = Payload.load(files.payload)
    with Recording(files.recording, payload) as recording:
        truth, _ = read_tum(files.trajectory, recording.clock.start_ns)
        batches = preprocess(recording.batches(), payload, Counter())
        lidar = [batch for batch in batches if isinstance(batch, LidarBatch)]
    files.recording.unlink()
    points = placed_points(lidar, truth, true_calibration(folder))
    upright, flat = ((-HALF, HALF), (0.0, TOP)), ((-HALF, HALF), (-HALF, HALF))
    return Covered(
        wall_density(points, 0, DISTANCE, limits=upright, cell=_CELL),
        wall_density(points, 1, DISTANCE, limits=upright, cell=_CELL),
        wall_density(points, 2, 0.0, limits=flat, cell=_CELL),
    )


def density_table(walls: dict[str, Covered]) -> TextTable:
    """Middle, sides and cover of the walls."""
    head = (
        "head",
        "across: middle",
        "sides",
        "covered, %",
        "along: middle",
        "sides",
        "covered, %",
        "floor covered, %",
    )
    rows = []
    for name, covered in walls.items():
        cells = [name]
        for wall in (covered.across, covered.along):
            middle, sides, share = _summary(wall)
            cells += [f"{middle:.0f}", f"{sides:.0f}", f"{100 * share:.0f}"]
        cells.append(f"{100 * (covered.floor > 0).mean():.0f}")
        rows.append(tuple(cells))
    note = (
        "Points per m² on the wall across the motor's axis and on the one along it, 10 m away; covered are the cells of "
        f"{_CELL:g} m with a point. In the paper the wall across is densest in its middle and the wall along "
        "slightly denser at its sides; the slower turn gives the denser band on the ground."
    )
    return TextTable("Two walls: figures 6 and 11", head, rows, note)


def _summary(wall: Array) -> tuple[float, float, float]:
    """Mean density within 2 m of the middle and beyond 6 m to the sides, and share of cells covered."""
    n, near, far = len(wall), round(2.0 / _CELL), round(4.0 / _CELL)
    up = slice(round(3.0 / _CELL), round(7.0 / _CELL))
    sides = np.concatenate([wall[:far, up], wall[-far:, up]])
    middle = wall[n // 2 - near : n // 2 + near, up]
    return float(middle.mean()), float(sides.mean()), float((wall > 0).mean())


def wall_figures(walls: dict[str, Covered]) -> list[Figure]:
    """Both walls side by side, unfolded at their corner, for every head."""
    figures = []
    for number, (name, covered) in enumerate(walls.items()):
        # Along the parallel wall from x = -10 m to the corner, then along the other away from it.
        unfolded = np.concatenate([covered.along, covered.across[::-1]])
        figures.append(
            Figure(
                f"fig06{'abc'[number]}",
                _drawn(unfolded, f"Densities, {name}"),
                f"Figs. 6 and 11, {name}",
                "Points per m² on both walls, unfolded at their corner: left the wall along the motor's axis, "
                "right the one across. White: no point.",
            )
        )
        figures.append(
            Figure(
                f"fig11{'abc'[number]}",
                _drawn(covered.floor, f"Density of the floor, {name}"),
                f"Figs. 6 and 11, floor, {name}",
                "Points per m² on the floor.",
            )
        )
    return figures


def _drawn(density: Array, name: str) -> str:
    """Draw densities (A, B) on a logarithmic scale, the second axis upwards."""
    if not density.any():
        return '<p class="none">No point fell here.</p>'
    seen = density.T[::-1]
    low, high = _DECADES
    with np.errstate(divide="ignore"):
        decades = np.log10(seen)
    image = np.full((*seen.shape, 3), 255, np.uint8)
    filled = seen > 0
    shade = (decades[filled] - low) / (high - low)
    image[filled] = colour(np.clip(shade, 0.0, 1.0), HEIGHT)
    large = np.ascontiguousarray(np.repeat(np.repeat(image, _PIXELS, axis=0), _PIXELS, axis=1))
    view = View(large, _CELL / _PIXELS, 0.0, 0.0, low, high)
    return map_view(view, "log10 points/m²", HEIGHT, name=name, text_size=13)
