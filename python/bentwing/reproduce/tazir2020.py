# SPDX-License-Identifier: MIT OR Apache-2.0
"""Tazir 2020: lidar odometry with a turning and with a fixed Velodyne, over a town and a dam."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bentwing.reproduce.campaign import flight_job, gather
from bentwing.reproduce.figure import Compared, Part, TextTable
from bentwing.reproduce.tazir_figures import tazir_figures
from bentwing.reproduce.tazir_measures import Measured, measure
from bentwing.reproduce.tazir_walls import WALLS, density_table, wall_figures, wall_job
from bentwing.reproduce.trials import Flight, Trial

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from bentwing.reproduce.campaign import Flown, Result
    from bentwing.reproduce.figure import Assignment
    from bentwing.reproduce.tazir_walls import Covered

    Array = NDArray[np.float64]

_BOTH = (Trial("ndt", "ndt"), Trial("continuous", "continuous"))
_AIR = {"flight": "survey", "calibrated": True}


def _flight(name: str, scene: str, rate: float | None, duration: float, quick: float) -> Flight:
    head = {"head": "vlp16-side"} if rate is None else {"head": "vlp16-motor", "motor_rate": rate}
    return Flight(name, {"scene": scene, **_AIR, **head}, duration, quick, _BOTH)


FLIGHTS = (
    _flight("town, 0.5 rad/s", "town", 0.5, 104.0, 20.0),
    _flight("town, 1 rad/s", "town", 1.0, 104.0, 20.0),
    _flight("town, fixed", "town", None, 104.0, 20.0),
    _flight("dam, 0.5 rad/s", "dam", 0.5, 62.0, 15.0),
    _flight("dam, fixed", "dam", None, 62.0, 15.0),
)
_PAPER_RTE = {"town, 0.5 rad/s": "0.467", "town, 1 rad/s": "0.801", "town, fixed": "diverges", "dam, fixed": "no map"}  # fmt: skip
_PAPER_RMSE = {"town, 0.5 rad/s": "0.135", "town, 1 rad/s": "0.223"}
_PAPER_FAR = {"town, 0.5 rad/s": "about 100", "town, fixed": "20 (10 m off)"}
_NOTE = (
    "RTE and RRE are the errors of poses with the first one given (equations 8 and 9); ATE is the root mean "
    "square after aligning the whole. The registration's RMSE is the distance of the points of a scan from "
    "the surfaces of the keyframes. `ndt` sees what the paper's odometry sees: the lidar and the motor's angle "
    "(its map is levelled by the IMU, which no error here depends on). `continuous` also has the IMU, runs open "
    "loop, and is not from the paper. As in the paper the head is calibrated."
)
_RTE_AIMS = (
    ("town, 0.5 rad/s", "ndt", 0.3, "0.467"),
    ("town, 0.5 rad/s", "continuous", 0.05, "0.467"),
    ("town, 1 rad/s", "ndt", 0.5, "0.801"),
)


def tazir_part(assignment: Assignment) -> Part:
    """Fly, estimate, compare and draw."""
    jobs = [flight_job(f, assignment) for f in FLIGHTS] + [wall_job(w, assignment) for w in WALLS]
    found = gather(jobs, assignment)
    flown: dict[str, Flown] = {f.name: found[f.name] for f in FLIGHTS}
    walls: dict[str, Covered] = {w.name: found[w.name] for w in WALLS}
    measured = {
        name: {t: measure(f, r) for t, r in f.results.items() if r.trajectory is not None}
        for name, f in flown.items()
    }
    with assignment.progress.stage("draw"):
        figures = [*wall_figures(walls), *tazir_figures(flown, measured)]
    numbers: dict[str, Any] = {
        name: {trial: _numbers(m, flown[name].results[trial]) for trial, m in found.items()}
        for name, found in measured.items()
    }
    numbers["timings"] = {
        name: {t: {"seconds": r.seconds, "cpu": r.cpu, "recorded": r.length} for t, r in f.results.items()}
        for name, f in flown.items()
    }  # fmt: skip
    tables = [_table(flown, measured), density_table(walls)]
    title = "Tazir 2020: rotating and fixed Velodyne platforms"
    return Part(title, figures, numbers, _compared(measured), tables)


def _table(flown: dict[str, Flown], measured: dict[str, dict[str, Measured]]) -> TextTable:
    head = (
        "flight", "estimator", "way, m", "RTE mean, paper, m", "RTE mean, m", "RTE largest, m", "RRE mean, °",
        "ATE, m", "registration RMSE, paper, m", "registration RMSE, m", "past 1 m after, paper, m", "past 1 m after, m",
    )  # fmt: skip
    rows = []
    for name, flight in flown.items():
        for trial, result in flight.results.items():
            paper = trial == "ndt"
            cells = [
                name,
                trial,
                f"{flight.way[-1]:.0f}",
                _PAPER_RTE.get(name, "") if paper else "",
            ]
            found = measured[name].get(trial)
            if found is None:
                rows.append((*cells, "gives up", *[""] * 7))
                continue
            rmse = f"{found.registration[:, 1].mean():.3f}" if len(found.registration) else ""
            rows.append((
                *cells, f"{found.errors.rte.mean():.3f}", f"{found.errors.rte.max():.2f}",
                f"{np.degrees(found.errors.rre.mean()):.3f}", f"{result.rmse:.3f}",
                _PAPER_RMSE.get(name, "") if paper else "", rmse,
                _PAPER_FAR.get(name, "") if paper else "",
                "never" if found.lost_after is None else f"{found.lost_after:.0f}",
            ))  # fmt: skip
    return TextTable("Trajectories: figures 7, 8, 12 and 13", head, rows, _NOTE)


def _compared(measured: dict[str, dict[str, Measured]]) -> list[Compared]:
    rows = []
    for flight, trial, aim, paper in _RTE_AIMS:
        found = measured[flight].get(trial)
        rte = float("inf") if found is None else float(found.errors.rte.mean())
        rows.append(
            Compared(
                f"{flight}: mean RTE of {trial}, m", paper, f"{rte:.3f}", f"≤ {aim:g}", rte <= aim
            )
        )
    slow, fast, fixed = (
        measured[f"town, {kind}"].get("ndt") for kind in ("0.5 rad/s", "1 rad/s", "fixed")
    )
    if slow is not None and fast is not None:
        rows.append(
            Compared(
                "town: mean registration RMSE of ndt at 0.5 and 1 rad/s, m",
                "0.135 and 0.223",
                f"{slow.registration[:, 1].mean():.3f} and {fast.registration[:, 1].mean():.3f}",
            )
        )
    if fixed is not None:
        ours = (
            "stays within 1 m"
            if fixed.lost_after is None
            else f"past 1 m after {fixed.lost_after:.0f} m"
        )
        rows.append(
            Compared(
                "town, fixed: ndt",
                "diverges after 20 m",
                f"{ours}, {fixed.errors.rte.max():.1f} m at most",
            )
        )
    return rows


def _numbers(found: Measured, result: Result) -> dict[str, Any]:
    rmse = found.registration
    return {
        "way_m": float(found.way[-1]),
        "rte_mean_m": float(found.errors.rte.mean()),
        "rte_max_m": float(found.errors.rte.max()),
        "rre_mean_deg": float(np.degrees(found.errors.rre.mean())),
        "ate_rmse_m": result.rmse,
        "registration_rmse_m": float(rmse[:, 1].mean()) if len(rmse) else None,
        "lost_after_m": found.lost_after,
    }
