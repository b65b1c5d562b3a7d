# SPDX-License-Identifier: MIT OR Apache-2.0
"""A run as its report shows it: turned to grid north, drawn, and with the words of a language."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bentwing.report.coverage import draw_coverage
from bentwing.report.frame import ShownFrame
from bentwing.report.marks import marks_of
from bentwing.report.views import draw_views

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.report.coverage import Coverage
    from bentwing.report.texts import Texts
    from bentwing.report.views import MapViews


@dataclass(frozen=True, slots=True)
class Drawn:
    """What the sections of a report are made of.

    Attributes
    ----------
    record : of the run, as in run.json
    trajectory : of the IMU, shown coordinates
    points, times : (N, 3) m, shown coordinates, and (N,) s, of the map
    views, coverage : of the map; None without points
    frame : from the map's frame to shown coordinates
    texts : words of the language
    """

    record: Mapping[str, Any]
    trajectory: Trajectory
    points: NDArray[np.float64]
    times: NDArray[np.float64]
    views: MapViews | None
    coverage: Coverage | None
    frame: ShownFrame
    texts: Texts

    @classmethod
    def of(
        cls,
        record: Mapping[str, Any],
        trajectory: Trajectory,
        sample: tuple[NDArray[np.float64], NDArray[np.float64]],
        texts: Texts,
    ) -> Drawn:
        """Draw a run; trajectory and sample are in the map's frame."""
        places, times = sample
        georeference = record.get("georeference")
        frame = ShownFrame.of(georeference)
        points, way = frame.points(places), frame.trajectory(trajectory)
        if not len(points):
            return cls(record, way, points, times, None, None, frame, texts)
        n_points = int((record.get("counts") or {}).get("map.points") or len(points))
        marks = marks_of(georeference, frame)
        windows = record.get("windows") or []
        views = draw_views(points, times, way, windows, frame=frame, marks=marks, texts=texts)
        coverage = draw_coverage(points, times, n_points, texts)
        return cls(record, way, points, times, views, coverage, frame, texts)
