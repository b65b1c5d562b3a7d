# SPDX-License-Identifier: MIT OR Apache-2.0
"""The figures of an evaluation, as Kaul 2015 has them in section 4.2."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bentwing.base.atomic import write_text
from bentwing.evaluate.robust import Line
from bentwing.report.charts import BoxGroup, Sample, box_plot, histogram, scatter
from bentwing.report.error_map import draw_error_map, write_error_cloud
from bentwing.report.evaluation_page import evaluation_page
from bentwing.report.plot import Series, line_plot
from bentwing.report.svg import standalone

if TYPE_CHECKING:
    from bentwing.evaluate.against_surface import MapError
    from bentwing.evaluate.against_track import TrackError
    from bentwing.evaluate.drift_boxes import DriftBoxes
    from bentwing.evaluate.evaluation import Evaluation
    from bentwing.evaluate.folder import EvaluationFolder

_CM = 100.0
_DEGREES = 180.0 / np.pi


def draw_evaluation(folder: EvaluationFolder, evaluation: Evaluation, name: str) -> None:
    """Write a figure for every answer that has a distribution, and a page of all answers.

    Parameters
    ----------
    name : of what was evaluated
    """
    if evaluation.map is not None:
        write_error_cloud(folder.file("map_error.ply"), evaluation.map)
    drawings = evaluation_drawings(evaluation)
    for kind, drawing in drawings.items():
        write_text(folder.file(f"{kind}.svg"), standalone(drawing))
    page = evaluation_page(evaluation, drawings, name)
    write_text(folder.file("evaluation.html"), page)


def evaluation_drawings(evaluation: Evaluation) -> dict[str, str]:
    """Draw every answer that has a distribution, as SVG by name."""
    drawings: dict[str, str] = {}
    if evaluation.trajectory is not None:
        drawings |= _trajectory(evaluation.trajectory)
    if evaluation.drift is not None and evaluation.drift.lengths:
        drawings |= _drift(evaluation.drift.lengths)
    if evaluation.map is not None:
        drawings |= _map(evaluation.map)
    return drawings | _alone(evaluation)


def _trajectory(error: TrackError) -> dict[str, str]:
    errors = _CM * error.errors
    distances = np.linalg.norm(errors, axis=1)
    reach = _nice(np.percentile(np.abs(errors), 99.5))
    series = [Series(name, error.times, errors[:, i]) for i, name in enumerate("xyz")]
    axes = [
        Sample(f"{name}: {_mean_and_std(errors[:, i], 'cm')}", errors[:, i])
        for i, name in enumerate("xyz")
    ]
    line = error.error_over_speed
    scaled = None if line is None else Line(_CM * line.slope, _CM * line.intercept)
    top = float(np.percentile(distances, 99.5)) * 1.1
    labels = ("speed of the platform, m/s", "distance to the reference, cm")
    return {
        "trajectory_differences": histogram(axes, "estimate minus reference, cm", (-reach, reach)),
        "trajectory_over_time": line_plot(
            series, "time, s", "estimate minus reference, cm", width=960, height=300
        ),
        "trajectory_over_speed": scatter(error.speeds, distances, labels, scaled, top),
    }


def _drift(lengths: list[DriftBoxes]) -> dict[str, str]:
    places = [f"{part.length:g}" for part in lengths]
    translation = [
        BoxGroup("horizontal", [part.horizontal for part in lengths]),
        BoxGroup("vertical", [part.vertical for part in lengths]),
    ]
    rotation = [
        BoxGroup("about horizontal axes", [part.tilt for part in lengths]),
        BoxGroup("about the vertical", [part.heading for part in lengths]),
    ]
    way = "length of the segment, m"
    return {
        "drift_translation": box_plot(translation, places, (way, "drift, mm per m"), 1e3),
        "drift_rotation": box_plot(rotation, places, (way, "drift, ° per m"), _DEGREES),
    }


def _map(error: MapError) -> dict[str, str]:
    distances = _CM * error.distances
    span = (-_CM * error.threshold, _CM * error.threshold)
    reach = min(span[1], _nice(5 * float(distances.std())))
    note = f"{_mean_and_std(distances, 'cm')}; {error.n_left_out / error.n_points:.2%} left out"
    return {
        "map_error_histogram": histogram(
            [Sample("map", distances)],
            "distance from the reference, cm (negative: in front)",
            (-reach, reach),
            note,
        ),
        "map_error": draw_error_map(error),
    }


def _alone(evaluation: Evaluation) -> dict[str, str]:
    drawings: dict[str, str] = {}
    spacings = [
        Sample(
            f"{name}: median {1e3 * spacing.median:.1f} mm",
            1e3 * spacing.distances.astype(np.float64),
        )
        for name, spacing in (
            ("map", evaluation.spacing),
            ("reference", evaluation.reference_spacing),
        )
        if spacing is not None
    ]
    if spacings:
        reach = _nice(max(float(np.percentile(s.values, 97)) for s in spacings))
        note = spacings[0].name if len(spacings) == 1 else ""
        drawings["point_spacing"] = histogram(
            spacings, "distance to the nearest point, mm", (0.0, reach), note
        )
    if evaluation.thickness is not None:
        stds = 1e3 * evaluation.thickness.stds
        drawings["wall_thickness"] = histogram(
            [Sample("walls", stds)],
            "thickness of flat patches, one standard deviation, mm",
            (0.0, _nice(float(np.percentile(stds, 98)))),
            f"median {np.median(stds):.1f} mm",
        )
    if evaluation.revisits is not None:
        offsets = 1e3 * evaluation.revisits.offsets
        reach = _nice(float(np.percentile(np.abs(offsets), 98)))
        drawings["revisits"] = histogram(
            [Sample("patches", offsets)],
            "offset between two visits of a patch, mm",
            (-reach, reach),
            f"robust standard deviation {1e3 * evaluation.revisits.std:.1f} mm",
        )
    return drawings


def _mean_and_std(values: np.ndarray, unit: str) -> str:
    # adding zero takes the sign from a negative zero
    return f"mean {round(values.mean(), 2) + 0.0:.2f}, std {values.std():.2f} {unit}"


def _nice(value: float) -> float:
    """Return the round number above a positive one."""
    magnitude = 10.0 ** np.floor(np.log10(max(value, 1e-9)))
    steps = (1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
    return float(next(m * magnitude for m in steps if m * magnitude >= value * (1 - 1e-9)))
