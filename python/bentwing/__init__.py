# SPDX-License-Identifier: MIT OR Apache-2.0
"""Accurate trajectories and 3D maps from lidars that move on their carrier, without GNSS."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
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
    from bentwing.base.trajectory import Trajectory
    from bentwing.flight.live import Odometry
    from bentwing.odometry.window import WindowResult, register_window
    from bentwing.recording import Payload, Recording
    from bentwing.run.merging import Merged, merge
    from bentwing.run.pipeline import map_recording
    from bentwing.run.run import Run

    __version__: str

__all__ = [
    "BentwingError",
    "DivergedError",
    "EstimationError",
    "InputError",
    "Merged",
    "NotEnoughDataError",
    "Odometry",
    "Payload",
    "PayloadError",
    "Recording",
    "RecordingError",
    "Run",
    "SingularSystemError",
    "Trajectory",
    "UsageError",
    "WindowResult",
    "__version__",
    "map_recording",
    "merge",
    "register_window",
]

# Where the names live; imported when first asked for, so that `import bentwing` costs nothing.
_HOMES = {
    "Odometry": "flight.live",
    "Merged": "run.merging",
    "merge": "run.merging",
    "map_recording": "run.pipeline",
    "Payload": "recording",
    "Recording": "recording",
    "WindowResult": "odometry.window",
    "register_window": "odometry.window",
    "Run": "run.run",
    "Trajectory": "base.trajectory",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        return import_module("bentwing.base.provenance").bentwing_version()
    if name not in __all__:
        msg = f"module {__name__!r} has no attribute {name!r}"
        raise AttributeError(msg)
    return getattr(import_module(f"bentwing.{_HOMES.get(name, 'base.errors')}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
