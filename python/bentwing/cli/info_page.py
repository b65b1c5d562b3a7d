# SPDX-License-Identifier: MIT OR Apache-2.0
"""The page that `bentwing info` prints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape
from rich.table import Table
from rich.text import Text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from rich.console import RenderableType

    from bentwing.calibrate.inspection import Inspection
    from bentwing.calibrate.inspection.look import TopicReport
    from bentwing.calibrate.inspection.spin import Spin
    from bentwing.calibrate.set_up import SetUp

BARS = "▁▂▃▄▅▆▇█"
SPARKLINE_WIDTH = 60
MAX_GAPS = 3


def page(inspection: Inspection) -> Iterator[RenderableType]:
    """Yield the parts of the page, top to bottom."""
    yield f"[bold]{escape(', '.join(inspection.paths))}[/bold]  {inspection.duration:.1f} s"
    yield _topics(inspection.topics)
    yield from _sensors(inspection)
    yield from (f"[yellow]warning[/yellow]  {escape(text)}" for text in inspection.warnings)
    yield from (f"[red]defect[/red]   {escape(text)}" for text in inspection.defects)
    if inspection.is_fit:
        yield "[green]fit for mapping[/green]"
    else:
        yield f"[red]not fit for mapping[/red]: {len(inspection.defects)} defect(s), see above"


def _topics(topics: list[TopicReport]) -> Table:
    table = Table("topic", "type", "used as", box=None)
    for heading in ("messages", "Hz"):
        table.add_column(heading, justify="right")
    table.add_column("gaps")
    for topic in topics:
        table.add_row(
            escape(topic.name),
            escape(topic.type),
            topic.role,
            str(topic.count),
            f"{topic.rate_hz:.1f}",
            _gaps(topic.gaps),
        )
    return table


def _gaps(gaps: list[tuple[float, float]]) -> str:
    longest = sorted(gaps, key=lambda gap: -gap[1])[:MAX_GAPS]
    text = ", ".join(f"{length:.1f} s at {start:.1f} s" for start, length in longest)
    return text + (f" and {len(gaps) - MAX_GAPS} more" if len(gaps) > MAX_GAPS else "")


def _sensors(inspection: Inspection) -> Iterator[RenderableType]:
    made = any((inspection.point_times or "") in warning for warning in inspection.warnings)
    if inspection.point_times is not None and not made:  # a warning says all of it
        yield f"times      {escape(inspection.point_times)}"
    if inspection.fields:
        fields = ", ".join(f"{name} ({kind})" for name, kind in inspection.fields.items())
        yield f"fields     {escape(fields)}"
    for number, (role, clock) in enumerate(inspection.clocks.items()):
        yield f"{'' if number else 'clocks':10} {escape(role)} {escape(clock)}"
    if inspection.spin is not None:
        yield from _spin(inspection.spin)
    if inspection.static_start is not None:
        start, end = inspection.static_start
        yield f"start      static from {start:.1f} to {end:.1f} s"
    if inspection.tf_mount is not None:
        yield f"frames     {escape(inspection.tf_mount.sentence)}"
        yield from _pasteable(inspection.tf_mount.line)
    yield from _set_up(inspection.set_up)
    for one in inspection.self_hits:
        first, last = ([f"{c:.2f}" for c in corner] for corner in (one.box.min, one.box.max))
        yield f"carrier    seen from ({' '.join(first)}) to ({' '.join(last)}) m, lidar frame"
    structure = inspection.structure
    if structure is not None and structure.n_points:
        low, _, middle, _, high = structure.range_percentiles
        yield (
            f"structure  {structure.n_points} returns, {structure.valid_share:.0%} of the beams; "
            f"ranges {low:.1f} to {high:.1f} m (5 to 95 %), median {middle:.1f} m; "
            f"{structure.far_share:.0%} beyond 20 m"
        )


def _set_up(set_up: SetUp | None) -> Iterator[RenderableType]:
    if set_up is None:
        return
    if set_up.doubt is not None:
        yield f"set-up     [yellow]not found[/yellow]: {escape(set_up.doubt)}"
    elif not set_up.findings:
        yield "set-up     as the payload says"
    for finding in set_up.findings:
        yield f"set-up     [yellow]{escape(finding.sentence)}[/yellow]"
        yield from _pasteable(finding.line)


def _pasteable(line: str) -> Iterator[Text]:
    """Yield a line of payload.yaml, which is not wrapped."""
    if line:
        yield Text(f"           {line}", style="bold", no_wrap=True, overflow="ignore")


def _spin(spin: Spin) -> Iterator[str]:
    if not spin.rates:
        return
    usual = f"{spin.usual:.2f} rad/s" if spin.usual else "no steady spin"
    yield f"turning    {usual} ({spin.source}), at most {max(spin.rates):.2f} rad/s"
    yield f"           {_sparkline(spin.rates)}"


def _sparkline(values: list[float]) -> str:
    step = max(1, -(-len(values) // SPARKLINE_WIDTH))
    means = [
        sum(values[i : i + step]) / len(values[i : i + step]) for i in range(0, len(values), step)
    ]
    top = max(max(means), 1e-9)
    return "".join(BARS[min(len(BARS) - 1, int(mean / top * len(BARS)))] for mean in means)
