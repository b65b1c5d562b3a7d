# SPDX-License-Identifier: MIT OR Apache-2.0
"""How far the evidence on good and on faulted runs lies from the bounds of the verdict.

    python -m benches faults --heads hokuyo-spin --scenes office --good 16
    python -m benches verdict --figure docs/images/verdict/distributions.svg

reads what the first command has kept, prints each kind's greatest value on good runs and how often it
alone gives a wrong map away, and draws the distributions.
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from types import SimpleNamespace

from benches.support import tables
from benches.support.fault_outcomes import is_wrong
from bentwing.evaluate.simulated import WorldError
from bentwing.evaluate.verdict import KINDS
from bentwing.report.svg import FAINT, INK, open_svg, standalone, text

RESULTS = Path(__file__).parent / "results" / "faults.json"
GOOD, RIGHT, WRONG = "#2f8f5b", "#8a96a5", "#c8412e"
LEFT, WIDTH, ROW, TOP = 150, 760, 34, 46
LOWEST, HIGHEST = 1e-3, 1e3
"""Of the axis, in units of what is doubtful."""


def runs(results: list[dict]) -> list[SimpleNamespace]:
    """The runs with evidence, and whether each is good, faulted and right, or wrong."""
    found = []
    for row in results:
        measures = (row.get("verdict") or {}).get("measures")
        if measures:
            found.append(SimpleNamespace(colour=colour_of(row), measures=measures, row=row))
    return found


def colour_of(row: dict) -> str:
    """The colour of a run."""
    if row["fault"] is None:
        return GOOD
    if row["error"] is None or row["good"] is None:
        return WRONG
    return WRONG if is_wrong(WorldError(**row["error"]), WorldError(**row["good"])) else RIGHT


def ratio(value: float | None, kind: str) -> float:
    """A value in units of what is doubtful; what is not finite is written as null."""
    return HIGHEST if value is None else value / KINDS[kind].doubtful


def table(found: list[SimpleNamespace]) -> str:
    """What each kind says of good runs and of wrong ones."""
    head = ("kind", "doubtful above", "good, greatest", "good beyond", "wrong maps beyond")
    lines = [tables.head(head)]
    for name, kind in KINDS.items():
        good, wrong = (
            [ratio(r.measures[name], name) for r in found if r.colour == c and name in r.measures]
            for c in (GOOD, WRONG)
        )
        if good or wrong:
            cells = (
                f"{kind.doubtful:g}",
                f"{max(good, default=0.0) * kind.doubtful:.3g}",
                f"{sum(value > 1 for value in good)} of {len(good)}",
                f"{sum(value > 1 for value in wrong)} of {len(wrong)}",
            )
            lines.append(tables.line([name, *cells]))
    wrong = [run for run in found if run.colour == WRONG]
    silent = [run.row for run in wrong if run.row["state"] == "good"]
    told = [run.row for run in found if run.colour == GOOD and run.row["state"] != "good"]
    n_good = sum(run.colour == GOOD for run in found)
    lines += ["", f"wrong maps called good: {len(silent)} of {len(wrong)}",
              f"good runs called otherwise: {len(told)} of {n_good}"]  # fmt: skip
    return "\n".join(lines)


def place(value: float) -> float:
    """Where a value, in units of what is doubtful, lies on the axis."""
    share = math.log(min(max(value, LOWEST), HIGHEST) / LOWEST) / math.log(HIGHEST / LOWEST)
    return LEFT + share * WIDTH


def figure(found: list[SimpleNamespace]) -> str:
    """Draw a line of dots for each kind."""
    kinds = [name for name in KINDS if any(name in run.measures for run in found)]
    height = TOP + ROW * len(kinds) + 50
    parts = [open_svg(LEFT + WIDTH + 30, height, "distributions of the evidence")]
    for x, (colour, name) in zip(
        (LEFT, LEFT + 160, LEFT + 400),
        (
            (GOOD, "good recordings"),
            (RIGHT, "faulted, the map is right"),
            (WRONG, "faulted, wrong"),
        ),
        strict=True,
    ):
        parts += [dot(x, 16, colour, 5), text(x + 12, 20, name, "start", INK)]
    for row, name in enumerate(kinds):
        parts += lines_of(name, TOP + ROW * row, found)
    bottom = TOP + ROW * len(kinds)
    for power in range(-3, 4):
        value = 10.0**power
        label = {0: "doubtful"}.get(power, f"{value:g}")
        parts.append(text(place(value), bottom + 16, label, "middle"))
    below = "measure over what is doubtful; the red stroke is what has failed"
    parts.append(text(LEFT + WIDTH / 2, bottom + 38, below, "middle", FAINT))
    edge = place(1.0)
    parts.append(f'<path d="M{edge:.1f} {TOP - 12}V{bottom}" stroke="#d9902a" stroke-width="2"/>')
    return "".join([*parts, "</svg>"])


def lines_of(name: str, y: float, found: list[SimpleNamespace]) -> list[str]:
    """One kind: its name, its bounds and its runs, wrong ones above."""
    parts = [text(LEFT - 12, y + 4, name.replace("_", " "), "end", INK)]
    parts.append(f'<path d="M{LEFT} {y}H{LEFT + WIDTH}" stroke="#e4e8ed"/>')
    failed = KINDS[name].failed / KINDS[name].doubtful
    if 1.0 < failed <= HIGHEST:
        parts.append(
            f'<path d="M{place(failed):.1f} {y - 12}V{y + 12}" stroke="{WRONG}" stroke-width="2"/>'
        )
    for colour, shift in ((WRONG, -7), (RIGHT, 0), (GOOD, 7)):
        parts += [
            dot(place(ratio(run.measures[name], name)), y + shift, colour, 3)
            for run in found
            if run.colour == colour and name in run.measures
        ]
    return parts


def dot(x: float, y: float, colour: str, radius: float) -> str:
    """Draw a run."""
    return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius}" fill="{colour}" fill-opacity=".55"/>'


def main() -> None:
    """Print the table, and draw the figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("results", nargs="*", type=Path, default=[RESULTS], help="default: %(default)s")  # fmt: skip
    parser.add_argument("--figure", type=Path, help="an SVG to draw the distributions into")
    options = parser.parse_args()
    found = runs([row for path in options.results for row in json.loads(path.read_text())])
    print(table(found))
    if options.figure is not None:
        options.figure.parent.mkdir(parents=True, exist_ok=True)
        options.figure.write_text(standalone(figure(found)), encoding="utf-8")
