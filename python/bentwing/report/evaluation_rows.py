# SPDX-License-Identifier: MIT OR Apache-2.0
"""What an evaluation says, as rows of name, value and note, for the terminal and for a page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.evaluate.against_surface import MapError
    from bentwing.evaluate.against_track import TrackError
    from bentwing.evaluate.evaluation import DriftOver, Evaluation
    from bentwing.evaluate.statistics import Box

Row = tuple[str, str, str]

_BARELY_SEEN = 0.3  # m; a lever arm of a greater standard deviation was not observed


class Block(NamedTuple):
    """Rows under a title; `head` names their columns where they are not name, value and note."""

    title: str
    rows: list[tuple[str, ...]]
    head: tuple[str, ...] = ()


def blocks_of(result: Evaluation) -> Iterator[Block]:
    """Yield what an evaluation says, top to bottom."""
    if result.trajectory is not None:
        yield Block("trajectory against the reference", [*_trajectory(result.trajectory)])
    if result.drift is not None and result.drift.lengths:
        yield _drift(result.drift)
    if result.map is not None:
        yield Block("map against the reference", [*_map(result.map)])
    if alone := list(_alone(result)):
        yield Block("map by itself", [*alone])


def _trajectory(error: TrackError) -> list[Row]:
    a = error.absolute
    spread = f"mean {100 * a.mean:.2f}, median {100 * a.median:.2f}, max {100 * a.maximum:.2f} cm"
    rows = [
        ("absolute error (ATE), rms", f"{100 * a.rmse:.2f} cm", f"{spread}, {a.n} stamps"),
        *(
            (
                f"difference in {name}",
                f"{round(100 * box.mean, 2) + 0.0:.2f} ± {100 * box.std:.2f} cm",
                _whiskers(box),
            )
            for name, box in error.axes.items()
        ),
    ]
    rows.append(_unaligned(error))
    if error.error_over_speed is not None:
        line = error.error_over_speed
        text = f"{100 * line.slope:+.2f} cm per m/s"
        rows.append(("error over speed", text, f"{100 * line.intercept:.2f} cm at rest"))
    for part in error.relative:
        found = part.translation or part.distance
        kind = "" if part.translation else " of distances"
        note = f"rms; median {1e3 * found.median:.1f} mm, {found.n} pieces"
        rows.append(
            (
                f"relative error{kind} (RPE) over {part.delta:g} m",
                f"{1e3 * found.rmse:.1f} mm",
                note,
            )
        )
    rows += _orientation(error)
    return [*rows, *_tracked_point(error)]


def _unaligned(error: TrackError) -> Row:
    found = error.unaligned
    shift = ", ".join(f"{name} {_metres(box.mean)}" for name, box in found.axes.items())
    note = f"median {_metres(found.position.median)}; mean difference {shift}"
    return "the same without alignment, rms", _metres(found.position.rmse), note


def _metres(value: float) -> str:
    return f"{100 * value + 0.0:.2f} cm" if abs(value) < 1.0 else f"{value:,.2f} m"


def _orientation(error: TrackError) -> list[Row]:
    rows: list[Row] = []
    if error.rotation is not None:
        turn = error.rotation
        note = f"{_degrees(turn.as_is.rmse)}° with the constant turn of {_degrees(turn.frame_rotation)}°"
        rows.append(("error of orientation, rms", f"{_degrees(turn.without_frame.rmse)}°", note))
    if error.rte is not None and error.rre is not None:
        rows.append(
            ("RTE, mean", f"{100 * error.rte.mean:.2f} cm", f"max {100 * error.rte.maximum:.2f} cm")
        )
        rows.append(("RRE, mean", f"{error.rre.mean:.5f}", f"max {error.rre.maximum:.5f} (√2 rad)"))
    return rows


def _tracked_point(error: TrackError) -> list[Row]:
    point = error.tracked_point
    note = "as given"
    if point.clock_offset_found is not None and point.clock_offset_std is not None:
        found = f"{point.clock_offset_found:.6g} ± {point.clock_offset_std:.1g} s"
        is_applied = point.clock_offset == point.clock_offset_found
        note = f"estimated {found}" if is_applied else f"same clock; estimated {found}"
    rows = [("clock offset of the reference", f"{point.clock_offset:.6g} s", note)]
    if point.lever_arm_std is None:
        if any(point.lever_arm):
            rows.append(("lever arm", _arm(point.lever_arm), "as given"))
        return rows
    unseen = [n for n, s in zip("xyz", point.lever_arm_std, strict=True) if s > _BARELY_SEEN]
    note = f"± {_arm(point.lever_arm_std)}"
    if unseen:
        note += f"; the motion does not show {', '.join(unseen)}"
    return [*rows, ("lever arm, estimated", _arm(point.lever_arm), note)]


def _drift(drift: DriftOver) -> Block:
    title = f"drift of the {drift.trajectory} against the {drift.against}, middle half (3 to 97 %)"
    head = ("over", "horizontal, mm/m", "vertical, mm/m", "tilt, m°/m", "heading, m°/m")
    millidegrees = 1e3 * math.degrees(1.0)
    rows = [
        (
            f"{part.length:g} m",
            _box(part.horizontal, 1e3),
            _box(part.vertical, 1e3),
            _box(part.tilt, millidegrees),
            _box(part.heading, millidegrees),
        )
        for part in drift.lengths
    ]
    return Block(title, [*rows], head)


def _map(error: MapError) -> list[Row]:
    side = "behind" if error.mean > 0 else "in front"
    front = (
        "towards the sensor" if error.front == "sensor" else "towards the middle of the reference"
    )
    left_out = error.n_left_out / error.n_points
    return [
        ("distance, mean", f"{100 * error.mean:+.2f} cm", f"{side}; the front is {front}"),
        ("distance, standard deviation", f"{100 * error.std:.2f} cm", f"robust {100 * error.robust_std:.2f} cm"),
        ("left out as changed", f"{left_out:.2%}", f"farther than {error.threshold:g} m, of {error.n_points} points"),
        ("completeness", f"{error.completeness:.1%}", f"of {error.n_surfels} surfels have a point within {error.surfel_edge:.2f} m"),
    ]  # fmt: skip


def _alone(result: Evaluation) -> Iterator[Row]:
    for name, spacing in (("", result.spacing), (" of the reference", result.reference_spacing)):
        if spacing is not None:
            note = f"5 to 95 %: {1e3 * spacing.p5:.1f} to {1e3 * spacing.p95:.1f} mm"
            yield f"point spacing{name}, median", f"{1e3 * spacing.median:.1f} mm", note
    if result.thickness is not None:
        found = result.thickness
        note = f"middle half {1e3 * found.p25:.1f} to {1e3 * found.p75:.1f} mm, {len(found.stds)} patches"
        yield "wall thickness, median", f"{1e3 * found.median:.1f} mm", note
    if result.revisits is not None:
        again = result.revisits
        note = f"95 % below {1e3 * again.p95:.1f} mm, {again.n_patches} patches"
        yield "offset between visits, robust std", f"{1e3 * again.std:.1f} mm", note
    if result.entropy is not None:
        crisp = result.entropy
        yield (
            "mean map entropy",
            f"{crisp.mean:.3f}",
            f"nat, within {crisp.radius:g} m; lower is crisper",
        )


def _whiskers(box: Box) -> str:
    return f"3 to 97 %: {100 * box.p3:+.2f} to {100 * box.p97:+.2f} cm"


def _degrees(angle: float) -> str:
    return f"{math.degrees(angle):.3f}"


def _arm(arm: tuple[float, float, float]) -> str:
    return ", ".join(f"{value:.3f}" for value in arm) + " m"


def _box(box: Box, factor: float) -> str:
    p3, p25, p75, p97 = (factor * value for value in (box.p3, box.p25, box.p75, box.p97))
    return f"{p25:+.2f} to {p75:+.2f} ({p3:+.2f}, {p97:+.2f})"
