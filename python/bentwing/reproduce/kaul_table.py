# SPDX-License-Identifier: MIT OR Apache-2.0
"""The figures of Kaul 2015, sections 3 and 4.2, beside ours."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from bentwing.reproduce.figure import Compared

if TYPE_CHECKING:
    from bentwing.evaluate.drift_boxes import DriftBoxes
    from bentwing.evaluate.statistics import Box
    from bentwing.reproduce.kaul_flights import Flown
    from bentwing.reproduce.kaul_measures import Measured

_MM, _CM = 1e3, 1e2
_DEGREES = math.degrees(1.0)
_HORIZONTAL, _VERTICAL = 1.0, 0.1  # mm/m, the middle half
_SPIN, _TILT = 0.01, 0.001  # °/m, the middle half
_MAP_STD, _NOISE_RATIO = 0.014, 1.1
_TIME_SHARE = 0.25  # of the flight

_PAPER_FLIGHTS = {
    "compound": "324 m in 6.8 min, 0.6 to 1.3 m/s, up to 8.8 m high",
    "forest": "206 m in 5.2 min, from 0.5 m/s, up to 14.1 m high",
}


def flight_rows(flown: Flown, measured: Measured) -> list[Compared]:
    """Tell what was flown, and how long its processing took."""
    name = flown.plan.name
    slow, fast = np.percentile(measured.speeds, [10, 90])
    minutes = flown.duration / 60
    total = flown.record["timings"]["total"]
    spin = np.degrees([rate for _, rate in flown.found.spin.samples])
    spun = spin[spin > 60.0]
    return [
        Compared(
            f"{name}: flight",
            _PAPER_FLIGHTS[name],
            f"{measured.way:.0f} m in {minutes:.1f} min, {slow:.1f} to {fast:.1f} m/s, "
            f"up to {measured.heights.max():.1f} m high",
        ),
        Compared(
            f"{name}: spin rate, median and largest",
            "250 and 350 °/s over 50 flights",
            f"{np.median(spun):.0f} and {spun.max():.0f} °/s",
        ),
        Compared(
            f"{name}: processing time over flight time",
            "below 1 on a laptop",
            f"{total / flown.duration:.2f} ({total:.0f} s)",
            f"≤ {_TIME_SHARE:g}",
            total <= _TIME_SHARE * flown.duration,
        ),
    ]


def track_rows(name: str, measured: Measured) -> list[Compared]:
    """Figs. 19 and 20."""
    track = measured.evaluation.trajectory
    if track is None:
        return []
    axes = ", ".join(
        f"{_CM * track.axes[a].mean:+.2f} ± {_CM * track.axes[a].std:.2f}" for a in "xyz"
    )
    line = track.error_over_speed
    slope = "" if line is None else f"{_CM * line.slope:.1f} cm per m/s"
    absolute = measured.absolute
    return [
        Compared(
            f"{name}: difference to the total station in x, y, z, cm",
            "zero-mean, a few cm, less in z",
            f"{axes} ({measured.share_tracked:.0%} of the flight in view)",
        ),
        Compared(f"{name}: that difference over speed", "highly correlated", slope),
        Compared(
            f"{name}: error of the trajectory in flight, rms",
            "not known",
            f"{_CM * absolute.position.rmse:.2f} cm, {_DEGREES * absolute.rotation.rmse:.3f}°",
        ),
    ]


def map_rows(measured: Measured, range_sigma: float) -> list[Compared]:
    """Figs. 22 and 23."""
    error, best, true = measured.evaluation.map, measured.best_std, measured.true_std
    own, reference = measured.evaluation.spacing, measured.evaluation.reference_spacing
    if error is None or best is None or true is None or own is None or reference is None:
        return []
    return [
        Compared(
            "map against terrestrial scans: mean",
            "close to zero",
            f"{_CM * error.mean:+.2f} cm",
        ),
        Compared(
            "map against terrestrial scans: standard deviation",
            "1.4 cm",
            f"{_CM * error.std:.2f} cm (range noise {_CM * range_sigma:.1f} cm; "
            f"{error.n_left_out / error.n_points:.2%} farther than {error.threshold:g} m)",
            f"≤ {_CM * _MAP_STD:.1f} cm",
            error.std <= _MAP_STD,
        ),
        Compared(
            "map against the true surfaces: standard deviation",
            "not known",
            f"{_CM * true:.2f} cm",
            f"≤ {_CM * _MAP_STD:.1f} cm",
            true <= _MAP_STD,
        ),
        Compared(
            "scans: that over the same of a map from true poses (the lidar's noise alone)",
            "“explained by the range noise”",
            f"{error.std / best:.3f}",
            f"≤ {_NOISE_RATIO:g}",
            error.std <= _NOISE_RATIO * best,
        ),
        Compared("completeness of the map", "not given", f"{error.completeness:.1%} of the scans"),
        Compared(
            "point spacing, median: map and terrestrial scans",
            "10 mm and 8 mm",
            f"{_MM * own.median:.1f} mm and {_MM * reference.median:.1f} mm",
        ),
    ]


def drift_rows(name: str, measured: Measured) -> list[Compared]:
    """Fig. 24: each aim holds for every length of the way."""
    boxes = [] if measured.evaluation.drift is None else measured.evaluation.drift.lengths
    if not boxes:
        return []
    kinds = (
        ("horizontal drift, mm/m", "within 1 half the time, extremes 5 to 6", _HORIZONTAL, _MM),
        ("vertical drift, mm/m", "a tenth of the horizontal", _VERTICAL, _MM),
        ("turn about the spin axis, °/m", "within 0.01 half the time", _SPIN, _DEGREES),
        ("turn about horizontal axes, °/m", "a tenth of that", _TILT, _DEGREES),
    )
    fields = ("horizontal", "vertical", "heading", "tilt")
    rows = []
    for field, (what, paper, aim, unit) in zip(fields, kinds, strict=True):
        ranges = {b.length: unit * _quartiles(getattr(b, field)) for b in boxes}
        truth = {b.length: unit * _quartiles(getattr(b, field)) for b in measured.against_truth}
        rows.append(
            Compared(
                f"{name}: {what}, middle half",
                paper,
                f"{_by_length(ranges)}; against the truth {_by_length(truth)}",
                f"≤ {aim:g}",
                max(ranges.values()) <= aim,
            )
        )
    return rows


def drift_numbers(boxes: list[DriftBoxes]) -> dict[str, dict[str, list[float]]]:
    """Percentiles 3, 25, 50, 75 and 97 by length, in mm/m and °/m."""
    units = {"horizontal": _MM, "vertical": _MM, "heading": _DEGREES, "tilt": _DEGREES}
    return {
        f"{part.length:g} m": {
            name: _percentiles(getattr(part, name), u) for name, u in units.items()
        }
        for part in boxes
    }


def _percentiles(box: Box, unit: float) -> list[float]:
    return [unit * value for value in (box.p3, box.p25, box.median, box.p75, box.p97)]


def _quartiles(box: Box) -> float:
    return box.p75 - box.p25


def _by_length(widths: dict[float, float]) -> str:
    """Widths of the boxes at the shortest and at the longest length, and the widest."""
    widest = max(widths, key=lambda length: widths[length])
    shown = sorted({min(widths), widest, max(widths)})
    parts = [f"{widths[length]:.2g} over {length:g} m" for length in shown]
    return ", ".join(parts)
