# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page that `bentwing plan` prints, and the same for programs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.table import Table

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from bentwing.flight.plan import Plan

_MAP_ROWS, _MAP_COLUMNS = 12, 48
_LEAST_COVERAGE = 0.05
_HOW = {
    "motor": "turned by its motor",
    "downdraft": "spun with its IMU about the IMU's z",
    "fixed": "fixed",
}


def page(plan: Plan) -> Iterator[RenderableType]:
    """Yield the parts of the page, top to bottom."""
    pattern = plan.pattern
    yield (
        f"head       {_HOW[plan.turning.turned]}; {pattern.rate_hz:g} sweeps per second, "
        f"{pattern.n_lines} line(s), beams {math.degrees(pattern.beam_step):.2f}° apart"
    )
    yield from _spin(plan)
    yield _spacings(plan)
    yield from _coverage(plan)
    yield (
        f"site       {plan.intent.area:g} m² take {plan.site_time / 60:.1f} min in the air, "
        f"{plan.n_flights} battery(ies) of {plan.intent.flight_time / 60:g} min"
    )


def as_record(plan: Plan) -> dict[str, Any]:
    """Return the plan in degrees, metres and seconds."""
    spin = plan.spin
    return {
        "turned": plan.turning.turned,
        "spin_rate_deg": None if spin is None else _rates(plan),
        "rate_deg": math.degrees(plan.rate),
        "spacings": [
            {"range": s.range, "along": s.along, "across": s.across} for s in plan.spacings
        ],
        "coverage": plan.coverage.share,
        "blind_cone_up_deg": math.degrees(plan.coverage.blind_up),
        "blind_cone_down_deg": math.degrees(plan.coverage.blind_down),
        "site_time": plan.site_time,
        "n_flights": plan.n_flights,
    }


def _rates(plan: Plan) -> dict[str, Any]:
    assert plan.spin is not None  # asked by the callers
    spin = plan.spin
    return {
        "lowest": math.degrees(spin.lowest),
        "highest": math.degrees(spin.lines),
        "rounded": list(spin.rounded_deg),
        "two_sweeps_per_window": math.degrees(spin.revolutions),
        "reobservation": math.degrees(spin.reobservation),
        "is_empty": spin.is_empty,
    }


def _spin(plan: Plan) -> Iterator[str]:
    if plan.spin is None:
        yield "spin       not turned: every sweep sees the same part of the sphere"
        return
    rates, (low, high), intent = _rates(plan), plan.spin.rounded_deg, plan.intent
    yield (
        f"spin       [bold]{low} to {high} °/s[/bold] ({rates['lowest']:.0f} to {rates['highest']:.0f})"
        if not plan.spin.is_empty
        else "[red]spin       no rate is acceptable[/red]: fly nearer, slower, or scan faster"
    )
    yield (
        f"           at most {rates['highest']:.0f} °/s: lines {intent.voxel_size:g} m apart at "
        f"{intent.distance:g} m"
    )
    yield (
        f"           at least {rates['two_sweeps_per_window']:.0f} °/s: two sweeps per window of "
        f"{intent.window:g} s"
    )
    yield (
        f"           at least {rates['reobservation']:.0f} °/s: {intent.distance / 2:g} m of path "
        f"between two views at {intent.speed:g} m/s"
    )


def _spacings(plan: Plan) -> Table:
    across = "across lines" if plan.pattern.n_lines > 1 else "from line to line"
    table = Table("range", "along a line", across, box=None, title_justify="left")
    if plan.spin is not None:
        table.title = f"points at {math.degrees(plan.rate):.0f} °/s"
    for s in plan.spacings:
        table.add_row(f"{s.range:g} m", f"{100 * s.along:.1f} cm", f"{100 * s.across:.1f} cm")
    return table


def _coverage(plan: Plan) -> Iterator[str]:
    seen = plan.coverage
    cones = [
        f"{math.degrees(angle):.0f}° {where}"
        for angle, where in ((seen.blind_up, "above"), (seen.blind_down, "below"))
        if angle > 0
    ]
    yield f"coverage   {seen.share:.0%} of the sphere; blind cone: {', '.join(cones) or 'none'}"
    if seen.share < _LEAST_COVERAGE:
        yield (
            "[yellow]warning[/yellow]    turned this way the scan plane stays in itself: tilt the "
            "lidar, or nod it by hand"
        )
    step = len(seen.seen) // _MAP_ROWS
    across = seen.seen.shape[1] // _MAP_COLUMNS
    shares = seen.seen[: _MAP_ROWS * step, : _MAP_COLUMNS * across].reshape(
        _MAP_ROWS, step, _MAP_COLUMNS, across
    )
    for k, row in enumerate(shares.mean(axis=(1, 3))[::-1]):
        label = {0: "zenith", _MAP_ROWS // 2: "level", _MAP_ROWS - 1: "nadir"}.get(k, "")
        cells = "".join(np.where(row > 0.75, "█", np.where(row > 0.25, "▒", "·")))
        yield f"{label:<10} {cells}"
