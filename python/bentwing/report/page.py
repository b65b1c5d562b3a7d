# SPDX-License-Identifier: MIT OR Apache-2.0
"""report.html: one file that shows what a run found and opens anywhere, without a network."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from bentwing.base.atomic import write_text
from bentwing.report import evidence
from bentwing.report.cover import cover, title_of
from bentwing.report.drawn import Drawn
from bentwing.report.engineering import engineering_section
from bentwing.report.html_page import html_page
from bentwing.report.languages import texts_of
from bentwing.report.localization import localization_section
from bentwing.report.merging import merging_section
from bentwing.report.on_earth import on_earth_section

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray

    from bentwing.base.trajectory import Trajectory
    from bentwing.evaluate.revisits import Revisits
    from bentwing.map.change import Change
    from bentwing.report.engineering import Spin
    from bentwing.report.texts import Texts


def write_report(
    path: Path,
    *,
    run_json: Mapping[str, Any],
    trajectory: Trajectory,
    map_sample: tuple[NDArray[np.float64], NDArray[np.float64]],
    map_values: NDArray[np.float32] | None = None,
    revisits: Revisits | None = None,
    change: Change | None = None,
    spin: Spin | None = None,
    cost: Callable[[], Mapping[str, Any]] | None = None,
    texts: Texts | None = None,
) -> None:
    """Write the report of a run.

    Parameters
    ----------
    path : file to write, atomically
    run_json : the record of the run, as in run.json
    trajectory : of the IMU in the map; may be empty after a failure
    map_sample : points (N, 3) m in the map and their times (N,) s; may be empty
    map_values : what `map.sample.VALUES` names of these points, (N, 3), NaN where it is not known
    revisits : how well what was seen twice agrees in the map
    change : what has changed since the map in which the recording was localized
    spin : times (M,) s and rate of turn (M,) rad/s of the sensor head
    cost : what run.json will say of time and memory, asked once all is drawn; default: what it says now
    texts : words of the language; default: of that which the project names
    """
    texts = texts or texts_of(run_json)
    with ThreadPoolExecutor(1) as beside:
        agreement = beside.submit(evidence.agreement_section, *map_sample, revisits, texts)
        drawn = Drawn.of(run_json, trajectory, map_sample, texts)
        in_space = evidence.map_section(drawn, map_values)
    parts = [
        cover(drawn),
        in_space,
        evidence.coverage_section(drawn),
        agreement.result(),
        localization_section(drawn, change),
        on_earth_section(run_json.get("georeference"), texts),
        merging_section(run_json.get("merging"), texts),
    ]
    described = {**run_json, **cost()} if cost is not None else run_json
    parts.append(engineering_section(described, trajectory, spin, texts))
    page = html_page(title_of(run_json, texts), "".join(parts), texts.language)
    write_text(path, page)
