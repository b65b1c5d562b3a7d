# SPDX-License-Identifier: MIT OR Apache-2.0
"""Accurate trajectories and 3D maps from lidars that move on their carrier, without GNSS.

Public are the names in `__all__`, here and in the packages of `PACKAGES`. Everything else may change.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bentwing import calibrate as calibrate
    from bentwing import closing as closing
    from bentwing import evaluate as evaluate
    from bentwing import flight as flight
    from bentwing import map as map  # noqa: A004 - not at run time
    from bentwing import odometry as odometry
    from bentwing import products as products
    from bentwing import recording as recording
    from bentwing import simulate as simulate
    from bentwing.base.breaks import Break
    from bentwing.base.calibration import Calibration
    from bentwing.base.covariances import PoseCovariances
    from bentwing.base.errors import (
        BentwingError,
        DivergedError,
        EstimationError,
        InputError,
        NotEnoughDataError,
        PayloadError,
        RecordingError,
        SingularSystemError,
        UsageError,
    )
    from bentwing.base.estimate import Estimate
    from bentwing.base.inertial_unit import InertialUnit
    from bentwing.base.mount import FixedMount, MotorErrors, MotorMount, Mount, Pose
    from bentwing.base.progress import Progress
    from bentwing.base.trajectory import Trajectory, read_tum
    from bentwing.base.window_record import WindowRecord
    from bentwing.fleet.record import Site
    from bentwing.fleet.site import map_fleet
    from bentwing.flight.live.odometry import Odometry
    from bentwing.odometry.window import register_window
    from bentwing.odometry.window_result import WindowResult
    from bentwing.recording.payload import Payload
    from bentwing.recording.recording import Recording
    from bentwing.run.export.export import Exported, export, export_points
    from bentwing.run.export.points import ExportOptions
    from bentwing.run.merging.runs import Merged, merge
    from bentwing.run.pipeline import map_recording
    from bentwing.run.run import Run

    __version__: str
else:
    from importlib import import_module

    from bentwing.base.lazy import lazy

    _load, _names = lazy(
        __name__,
        {
            "base.breaks": ["Break"],
            "base.calibration": ["Calibration"],
            "base.covariances": ["PoseCovariances"],
            "base.errors": [
                "BentwingError",
                "DivergedError",
                "EstimationError",
                "InputError",
                "NotEnoughDataError",
                "PayloadError",
                "RecordingError",
                "SingularSystemError",
                "UsageError",
            ],
            "base.estimate": ["Estimate"],
            "base.inertial_unit": ["InertialUnit"],
            "base.mount": ["FixedMount", "MotorErrors", "MotorMount", "Mount", "Pose"],
            "base.progress": ["Progress"],
            "base.trajectory": ["Trajectory", "read_tum"],
            "base.window_record": ["WindowRecord"],
            "fleet.record": ["Site"],
            "fleet.site": ["map_fleet"],
            "flight.live.odometry": ["Odometry"],
            "odometry.window": ["register_window"],
            "odometry.window_result": ["WindowResult"],
            "recording.payload": ["Payload"],
            "recording.recording": ["Recording"],
            "run.export.export": ["Exported", "export", "export_points"],
            "run.export.points": ["ExportOptions"],
            "run.merging.runs": ["Merged", "merge"],
            "run.pipeline": ["map_recording"],
            "run.run": ["Run"],
        },
    )

    def __getattr__(name: str) -> object:
        if name == "__version__":
            return import_module("bentwing.base.provenance").bentwing_version()
        return import_module(f"bentwing.{name}") if name in PACKAGES else _load(name)

    def __dir__() -> list[str]:
        return sorted([*_names(), *PACKAGES, "__version__"])


PACKAGES = (
    "recording",
    "odometry",
    "map",
    "closing",
    "evaluate",
    "products",
    "flight",
    "simulate",
    "calibrate",
)
"""The public packages; `bentwing.map` is there after `import bentwing`."""

__all__ = [
    "BentwingError",
    "Break",
    "Calibration",
    "DivergedError",
    "Estimate",
    "EstimationError",
    "ExportOptions",
    "Exported",
    "FixedMount",
    "InertialUnit",
    "InputError",
    "Merged",
    "MotorErrors",
    "MotorMount",
    "Mount",
    "NotEnoughDataError",
    "Odometry",
    "Payload",
    "PayloadError",
    "Pose",
    "PoseCovariances",
    "Progress",
    "Recording",
    "RecordingError",
    "Run",
    "SingularSystemError",
    "Site",
    "Trajectory",
    "UsageError",
    "WindowRecord",
    "WindowResult",
    "__version__",
    "export",
    "export_points",
    "map_fleet",
    "map_recording",
    "merge",
    "read_tum",
    "register_window",
]
