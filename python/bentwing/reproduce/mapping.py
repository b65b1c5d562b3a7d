# SPDX-License-Identifier: MIT OR Apache-2.0
"""Kaul 2015, section 4: Figs. 3, 8, 13, 19 to 25, and the accuracy behind them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.evaluate.statistics import summary
from bentwing.report import evaluation_drawings
from bentwing.report.colours import HEIGHT
from bentwing.reproduce.figure import Figure, Part
from bentwing.reproduce.kaul_flights import COMPOUND, FOREST, MINE, fly_and_map
from bentwing.reproduce.kaul_measures import measure
from bentwing.reproduce.kaul_pictures import compound_figures, map_from_above, map_oblique
from bentwing.reproduce.kaul_table import (
    drift_numbers,
    drift_rows,
    flight_rows,
    map_rows,
    track_rows,
)
from bentwing.reproduce.loop_stages import loop_figures
from bentwing.reproduce.ranges import range_figure

if TYPE_CHECKING:
    from bentwing.reproduce.figure import Assignment, Compared
    from bentwing.reproduce.kaul_flights import Flown
    from bentwing.reproduce.kaul_measures import Measured

_NAMES = {"compound": "built environment", "forest": "forest"}


def mapping_part(assignment: Assignment) -> Part:
    """Fly, map, measure and draw."""
    compound = fly_and_map(COMPOUND, assignment)
    measured = {"compound": measure(compound, assignment, scanned=True)}
    forest = fly_and_map(FOREST, assignment)
    measured["forest"] = measure(forest, assignment, scanned=False)
    mine = fly_and_map(MINE, assignment)
    of_compound = measured["compound"]
    stages, stage_rows = loop_figures(compound, of_compound.truth, of_compound.flight, assignment)
    with assignment.progress.stage("draw"):
        ranges, range_rows, medians = range_figure(
            {"compound": compound.setup, "forest": forest.setup}, assignment
        )
        drawings = {name: evaluation_drawings(m.evaluation) for name, m in measured.items()}
        figures = [
            *stages,
            ranges,
            Figure("fig13a", map_oblique(forest, HEIGHT), "Fig. 13a", "Map of the forest, by height."),
            Figure("fig13b", map_from_above(mine), "Fig. 13b", "A mine from above, without its roof, with the flight by time."),
            *compound_figures(compound, of_compound, drawings["compound"]),
            Figure("fig19c", map_oblique(forest), "Fig. 19c", "The forest stands in for the paper's hill with trees and a fence."),
            *_track_figures(drawings),
            *_drift_figures(drawings),
            Figure("fig25", map_from_above(forest, HEIGHT), "Fig. 25", "The forest from above, with the flight by time."),
        ]  # fmt: skip
    rows = [*range_rows]
    for flown in (compound, forest):
        rows += _rows(flown, measured[flown.plan.name])
    rows += stage_rows
    numbers: dict[str, Any] = {"range_medians_m": medians}
    numbers |= {name: _numbers(m) for name, m in measured.items()}
    # apart from the rest, because they are the only numbers that two runs do not share
    numbers["timings_s"] = {f.plan.name: f.record["timings"] for f in (compound, forest, mine)}
    title = "Kaul 2015, mapping: Figs. 3, 8, 13, 19 to 25"
    return Part(title, sorted(figures, key=lambda f: f.name), numbers, rows)


def _rows(flown: Flown, measured: Measured) -> list[Compared]:
    name = flown.plan.name
    sigma = flown.setup.rig.head.lidar.noise
    return [
        *flight_rows(flown, measured),
        *map_rows(measured, sigma),
        *drift_rows(name, measured),
        *track_rows(name, measured),
    ]


def _track_figures(drawings: dict[str, dict[str, str]]) -> list[Figure]:
    figures = []
    for name, letter in (("compound", "b"), ("forest", "d")):
        figures += [
            Figure(
                f"fig19{letter}",
                drawings[name]["trajectory_differences"],
                f"Fig. 19{letter}",
                f"Differences to the total station in the {_NAMES[name]}.",
            ),
            Figure(
                f"fig20_{name}",
                drawings[name]["trajectory_over_speed"],
                "Fig. 20",
                f"The same over speed in the {_NAMES[name]}: the prism moves while it is measured.",
            ),
        ]
    return figures


def _drift_figures(drawings: dict[str, dict[str, str]]) -> list[Figure]:
    kinds = (("drift_translation", "compound", "a"), ("drift_translation", "forest", "b"),
             ("drift_rotation", "compound", "c"), ("drift_rotation", "forest", "d"))  # fmt: skip
    return [
        Figure(
            f"fig24{letter}",
            drawings[name][kind],
            f"Fig. 24{letter}",
            f"Drift of the open loop against the closed loop, {_NAMES[name]}.",
        )
        for kind, name, letter in kinds
        if kind in drawings[name]
    ]


def _numbers(measured: Measured) -> dict[str, Any]:
    found = summary(measured.evaluation)
    return {
        "way_m": measured.way,
        "trajectory": found["trajectory"],
        "map": found["map"],
        "true_map_std_m": measured.true_std,
        "best_map_std_m": measured.best_std,
        "spacing": found["spacing"],
        "reference_spacing": found["reference_spacing"],
        "drift_against_closed_loop": drift_numbers(
            [] if measured.evaluation.drift is None else measured.evaluation.drift.lengths
        ),
        "drift_against_truth": drift_numbers(measured.against_truth),
        "rmse_m": measured.absolute.position.rmse,
        "rmse_rotation_rad": measured.absolute.rotation.rmse,
    }
