# SPDX-License-Identifier: MIT OR Apache-2.0
"""Evaluations of several runs side by side: a row each, for people, spreadsheets and programs."""

from __future__ import annotations

import csv
import io
import math
from html import escape
from typing import TYPE_CHECKING, Any, NamedTuple

from bentwing.report.html_page import html_page
from bentwing.report.sections import DASH, table

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from bentwing.evaluate.drift_boxes import DriftBoxes
    from bentwing.evaluate.evaluation import Evaluation
    from bentwing.evaluate.statistics import Box

    Read = Callable[[Evaluation], float | None]


class _Column(NamedTuple):
    """A measure: its name in files, in SI units; its heading for people, with factor and digits."""

    name: str
    heading: str
    factor: float
    digits: int
    read: Read


def _relative(delta: float) -> Read:
    def read(e: Evaluation) -> float | None:
        found = [] if e.trajectory is None else e.trajectory.relative
        part = next((p for p in found if p.delta == delta), None)
        return None if part is None else (part.translation or part.distance).rmse

    return read


def _rotation(e: Evaluation) -> float | None:
    turn = None if e.trajectory is None else e.trajectory.rotation
    return None if turn is None else turn.without_frame.rmse


def _longest(e: Evaluation) -> DriftBoxes | None:
    return e.drift.lengths[-1] if e.drift is not None and e.drift.lengths else None


def _drift_length(e: Evaluation) -> float | None:
    part = _longest(e)
    return None if part is None else part.length


def _drift(name: str) -> Read:
    def read(e: Evaluation) -> float | None:
        part = _longest(e)
        if part is None:
            return None
        box: Box = getattr(part, name)
        return max(abs(box.p25), abs(box.p75))

    return read


def _of(part: str, *names: str) -> Read:
    def read(e: Evaluation) -> float | None:
        value: Any = getattr(e, part)
        for name in names:
            value = None if value is None else getattr(value, name)
        return None if value is None else float(value)

    return read


_MILLIDEGREES = 1e3 * math.degrees(1.0)
_COLUMNS = (
    _Column("ate_rmse_m", "ATE, cm", 100.0, 2, _of("trajectory", "absolute", "rmse")),
    _Column(
        "unaligned_rmse_m", "unaligned, cm", 100.0, 2,
        _of("trajectory", "unaligned", "position", "rmse"),
    ),
    _Column("rpe_1m_rmse_m", "RPE 1 m, mm", 1e3, 1, _relative(1.0)),
    _Column("rpe_10m_rmse_m", "RPE 10 m, mm", 1e3, 1, _relative(10.0)),
    _Column("orientation_rmse_rad", "orientation, °", math.degrees(1.0), 3, _rotation),
    _Column("drift_over_m", "drift over, m", 1.0, 0, _drift_length),
    _Column("drift_horizontal", "horizontal, mm/m", 1e3, 2, _drift("horizontal")),
    _Column("drift_heading_rad_per_m", "heading, m°/m", _MILLIDEGREES, 2, _drift("heading")),
    _Column("map_mean_m", "map mean, cm", 100.0, 2, _of("map", "mean")),
    _Column("map_std_m", "map std, cm", 100.0, 2, _of("map", "std")),
    _Column("completeness", "completeness, %", 100.0, 1, _of("map", "completeness")),
    _Column("spacing_median_m", "spacing, mm", 1e3, 1, _of("spacing", "median")),
    _Column("thickness_median_m", "thickness, mm", 1e3, 1, _of("thickness", "median")),
    _Column("revisits_std_m", "revisits, mm", 1e3, 1, _of("revisits", "std")),
    _Column("entropy_mean_nat", "entropy, nat", 1.0, 3, _of("entropy", "mean")),
)  # fmt: skip


class EvaluationTable:
    """Rows are runs, columns the measures that any of them has.

    Parameters
    ----------
    names : of the runs
    evaluations : of them; None where that failed
    failures : sentences, why

    Attributes
    ----------
    failures : as given
    """

    def __init__(
        self,
        names: Sequence[str],
        evaluations: Sequence[Evaluation | None],
        failures: Sequence[str] = (),
    ) -> None:
        self._names, self.failures = names, tuple(failures)
        values = [[None if e is None else c.read(e) for c in _COLUMNS] for e in evaluations]
        kept = [k for k in range(len(_COLUMNS)) if any(row[k] is not None for row in values)]
        self._columns = [_COLUMNS[k] for k in kept]
        self._values = [[row[k] for k in kept] for row in values]

    @property
    def head(self) -> list[str]:
        """Headings for people."""
        return ["run", *(column.heading for column in self._columns)]

    @property
    def rows(self) -> list[list[str]]:
        """Values for people."""
        return [
            [name, *(_shown(v, c) for v, c in zip(values, self._columns, strict=True))]
            for name, values in zip(self._names, self._values, strict=True)
        ]

    def to_json(self) -> list[dict[str, Any]]:
        """Return a mapping of names and values, in SI units, for each run."""
        names = [column.name for column in self._columns]
        return [
            {"run": name, **dict(zip(names, values, strict=True))}
            for name, values in zip(self._names, self._values, strict=True)
        ]

    def to_csv(self) -> str:
        """Return the same as CSV; what is not known is empty."""
        text = io.StringIO()
        names = ["run", *(column.name for column in self._columns)]
        writer = csv.DictWriter(text, names, lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.to_json())
        return text.getvalue()

    def to_html(self) -> str:
        """Return a page with the table."""
        numbers = frozenset(range(1, len(self.head)))
        cells = table(tuple(self.head), [tuple(row) for row in self.rows], numbers=numbers)
        note = (
            "ATE and RPE are root mean squares against the reference trajectory, aligned unless the column "
            "says otherwise. Drift is the larger end of its middle half, over the longest distance that fits. "
            "Map, spacing, thickness of walls, offset between visits and entropy are those of each run's "
            "evaluation.html."
        )
        body = f"<header><h1>Evaluation of {len(self._names)} runs</h1></header>{cells}<p>{escape(note)}</p>"
        return html_page(f"Evaluation of {len(self._names)} runs", body)


def _shown(value: float | None, column: _Column) -> str:
    return DASH if value is None else f"{column.factor * value + 0.0:.{column.digits}f}"
