# SPDX-License-Identifier: MIT OR Apache-2.0
"""The maps of Kaul 2015 as ours: Figs. 13, 19, 21 and 25."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.report.colours import TIME
from bentwing.report.picture import paint, project
from bentwing.report.svg import map_view
from bentwing.report.views import oblique_view, overhead_points
from bentwing.report.way import Way
from bentwing.reproduce.figure import Figure

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.reproduce.kaul_flights import Flown
    from bentwing.reproduce.kaul_measures import Measured

CLAY = ("efe9df", "efe9df")  # one colour: what is seen is the light alone
_STATIONS = ("c8553d", "2c5f8a", "4d8b57", "b8912f", "7a5c99", "3b9aa0")
_PATH_STEP = 10  # of 100 Hz poses


def map_from_above(flown: Flown, table: tuple[str, ...] = CLAY) -> str:
    """Plan of a map with the way by time, blue to yellow; a roof is left out."""
    points, times = flown.found.sample.points, flown.found.sample.times
    kept = ~overhead_points(points, times, flown.run.trajectory)
    x, y, z = points[kept].T
    view = paint(project(x, y, z, width=1000, max_height=800), z, table=table)
    path = flown.run.trajectory.positions[::_PATH_STEP]
    way = Way(path[:, 0], path[:, 1], np.linspace(0.0, 1.0, len(path)), TIME)
    return map_view(view, "height, m", table, way=way, name=f"{flown.plan.name} from above")


def map_oblique(flown: Flown, table: tuple[str, ...] = CLAY) -> str:
    """Oblique view of a map with the way by time."""
    points = flown.found.sample.points
    path = flown.run.trajectory.positions[::_PATH_STEP]
    return oblique_view(points, points[:, 2], "height, m", table, path=path)


def stations_from_above(cloud: tuple[NDArray[np.float64], NDArray[np.float64]]) -> str:
    """Plan of a terrestrial cloud, a colour for each station."""
    points, stations = cloud
    view = paint(
        project(*points.T, width=1000, max_height=800), stations, table=_STATIONS, span=(0.0, 5.0)
    )
    return map_view(view, "station", _STATIONS, name="Terrestrial scans")


def compound_figures(flown: Flown, measured: Measured, drawings: dict[str, str]) -> list[Figure]:
    """Figs. 19a, 21b to 21d, 22 and 23."""
    error = measured.evaluation.map
    figures = [Figure("fig19a", map_oblique(flown), "Fig. 19a", "Map of the compound.")]
    if measured.terrestrial is None or error is None:
        return figures
    n = measured.n_terrestrial
    return [
        *figures,
        Figure(
            "fig21b",
            stations_from_above(measured.terrestrial),
            "Fig. 21b",
            f"Six terrestrial scans, {n / 1e6:.1f} million points, registered to about a millimetre.",
        ),
        Figure(
            "fig21c",
            map_from_above(flown),
            "Fig. 21c",
            "The map in ambient light, with the flight by time (dark to bright).",
        ),
        Figure(
            "fig21d",
            drawings["map_error"],
            "Fig. 21d",
            "The map by its distance from the terrestrial scans. What stands out are the rims of roofs "
            "that the scanner, 1.6 m above the ground, did not see.",
        ),
        Figure(
            "fig22",
            drawings["map_error_histogram"],
            "Fig. 22",
            "Distances of the map from the scans. In the paper: mean near zero, standard deviation 1.4 cm.",
        ),
        Figure(
            "fig23",
            drawings["point_spacing"],
            "Fig. 23",
            "Distance of each point to the nearest. In the paper: 10 mm, and 8 mm for the scans.",
        ),
    ]
