# SPDX-License-Identifier: MIT OR Apache-2.0
"""Fu 2023: positions in a room with motion capture, in a car park and outdoors (Table 2)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from bentwing.odometry.kalman import KalmanSettings
from bentwing.reproduce.campaign import flight_job, gather
from bentwing.reproduce.figure import Compared, Part, TextTable
from bentwing.reproduce.fu_figures import fu_figures
from bentwing.reproduce.trials import Flight, Trial

if TYPE_CHECKING:
    from bentwing.reproduce.campaign import Flown, Result
    from bentwing.reproduce.figure import Assignment

RATE = 6.2832
"""rad/s, of the motor: a turn in a second."""

OURS = Trial("kalman", "kalman", KalmanSettings())
IGNORED = Trial("R-FAST-LIO", "kalman", KalmanSettings(rotation="ignored"))
FIXED = Trial("F-FAST-LIO", "kalman", KalmanSettings())
CONTINUOUS = Trial("continuous", "continuous")

_SCENES = (("mocap", 75.0, 24.0), ("carpark", 75.0, 24.0), ("campus", 135.0, 24.0))
FLIGHTS = tuple(
    Flight(f"{scene}, {kind}", {"scene": scene, **head}, duration, quick, trials)
    for scene, duration, quick in _SCENES
    for kind, head, trials in (
        ("turning", {"head": "vlp16-motor", "motor_rate": RATE}, (OURS, CONTINUOUS, IGNORED)),
        ("fixed", {"head": "vlp16-fixed"}, (FIXED, CONTINUOUS)),
    )
)

_NAMES = {"mocap": "Indoor, motion capture", "carpark": "Indoor, car park", "campus": "Outdoor"}
_ROWS = (
    ("R-FAST-LIO", "turning", "rotation ignored"),
    ("F-FAST-LIO", "fixed", "fixed lidar"),
    ("kalman", "turning", "theirs: Ours"),
)
# Table 2: ATE and RMSE, m.
_PAPER = {
    ("mocap", "R-FAST-LIO"): ("Failed", "Failed"),
    ("mocap", "F-FAST-LIO"): ("0.062", "0.070"),
    ("mocap", "kalman"): ("0.034", "0.028"),
    ("campus", "R-FAST-LIO"): ("Failed", "Failed"),
    ("campus", "F-FAST-LIO"): ("1.25", "1.302"),
    ("campus", "kalman"): ("0.599", "0.654"),
}
_AIMS = (
    ("mocap", "kalman", 0.017, "0.034 (Ours)"),
    ("mocap", "continuous", 0.010, "0.034 (Ours)"),
    ("campus", "kalman", 0.10, "0.599 (Ours, against GPS)"),
)
_NOTE = (
    "ATE is the mean and RMSE the root mean square of the distances from the truth over all poses, the "
    "trajectories aligned as a whole; the paper's truth is motion capture indoors and GPS outdoors. "
    f"A run that ends more than 2 m RMSE off has failed. The motor turns once per second ({RATE:g} rad/s); the "
    "payload has mounts, clock and encoder as wrong as a builder's ruler makes them. The last columns are "
    "those of `continuous`, open loop, on the same recording. The paper gives neither numbers for the car "
    "park nor the length of its outdoor flight."
)


def fu_part(assignment: Assignment) -> Part:
    """Fly, estimate, compare and draw."""
    flown: dict[str, Flown] = gather([flight_job(f, assignment) for f in FLIGHTS], assignment)
    with assignment.progress.stage("draw"):
        figures = fu_figures(flown)
    numbers: dict[str, Any] = {
        name: {t: _numbers(r) for t, r in f.results.items()} | {"way_m": float(f.way[-1])}
        for name, f in flown.items()
    }
    numbers["timings"] = {
        name: {t: {"seconds": r.seconds, "cpu": r.cpu, "recorded": r.length} for t, r in f.results.items()}
        for name, f in flown.items()
    }  # fmt: skip
    title = "Fu 2023: rotating 3D laser mapping for multi-rotor drones"
    return Part(title, figures, numbers, _compared(flown), [_table(flown)])


def _table(flown: dict[str, Flown]) -> TextTable:
    head = (
        "Scene", "Algorithm", "ATE, paper, m", "ATE, m", "RMSE, paper, m", "RMSE, m", "largest, m",
        "way, m", "ATE of continuous, m", "RMSE of continuous, m",
    )  # fmt: skip
    rows: list[tuple[str, ...]] = []
    for scene, _, _ in _SCENES:
        for name, kind, note in _ROWS:
            flight = flown[f"{scene}, {kind}"]
            ate, rmse = _PAPER.get((scene, name), ("", ""))
            ours, other = _shown(flight.results[name]), _shown(flight.results["continuous"])
            cells = (ate, ours[0], rmse, ours[1], ours[2], f"{flight.way[-1]:.0f}", *other[:2])
            rows.append((_NAMES[scene], f"{name} ({note})", *cells))
    return TextTable("Table 2: positioning errors", head, rows, _NOTE)


def _shown(result: Result) -> tuple[str, str, str]:
    if result.lost:
        return "Failed", "Failed", ""
    return f"{result.ate:.4f}", f"{result.rmse:.4f}", f"{result.distances.max():.3f}"


def _compared(flown: dict[str, Flown]) -> list[Compared]:
    rows = []
    for scene, name, aim, paper in _AIMS:
        result = flown[f"{scene}, turning"].results[name]
        rows.append(
            Compared(
                f"{_NAMES[scene]}: ATE of {name}, m",
                paper,
                _shown(result)[0],
                f"≤ {aim:g}",
                result.ate <= aim,
            )
        )
    result = flown["mocap, turning"].results["kalman"]
    distances = result.distances
    ours = "Failed" if result.lost else ", ".join(
        f"{v:.4f}" for v in (distances.min(), distances.mean(), distances.max())
    )  # fmt: skip
    rows.append(
        Compared(
            "Indoor, motion capture: least, mean and largest error, m", "0.005, 0.04, 0.08", ours
        )
    )
    for scene in ("mocap", "campus"):
        result = flown[f"{scene}, turning"].results["R-FAST-LIO"]
        ours = "fails: it gives up" if result.aligned is None else f"RMSE {result.rmse:.3g} m"
        rows.append(
            Compared(
                f"{_NAMES[scene]}: with the rotation ignored", "fails", ours, "fails", result.lost
            )
        )
    return rows


def _numbers(result: Result) -> dict[str, Any]:
    if not len(result.distances):
        return {"failed": True, "why": result.why}
    return {
        "failed": result.lost,
        "ate_mean_m": result.ate,
        "ate_rmse_m": result.rmse,
        "largest_m": float(result.distances.max()),
    }
